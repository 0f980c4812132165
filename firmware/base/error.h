/* SPDX-License-Identifier: MIT
 * Errors of the whole C core: one list, from which the enum is generated. */
#ifndef COMPBOX_FIRMWARE_BASE_ERROR_H
#define COMPBOX_FIRMWARE_BASE_ERROR_H

/* X(name, value): the kind of mistake; the loader's message names the key and the line. Values are
 * stable, because logs and status registers show them. */
#define CB_ERRORS(X)                                                                     \
    X(CB_OK, 0)               /* no error */                                             \
    X(CB_ERROR_EMPTY, -1)     /* the coefficient file is empty or missing */             \
    X(CB_ERROR_TOO_LARGE, -2) /* the coefficient file is larger than the box can hold */ \
    X(CB_ERROR_SYNTAX, -3)    /* the text is not valid JSON */                           \
    X(CB_ERROR_KEY, -4)       /* a key is unknown, missing or given twice */             \
    X(CB_ERROR_TYPE, -5)      /* a value has the wrong type */                           \
    X(CB_ERROR_RANGE, -6)     /* a number is outside its range */                        \
    X(CB_ERROR_ORDER, -7)     /* numbers are not in the required order */                \
    X(CB_ERROR_FULL, -8)      /* there are more elements than the box has room for */    \
    X(CB_ERROR_NAME, -9)      /* a name is unknown, used twice or too long */            \
    X(CB_ERROR_OVERLAP, -10)  /* two values share a register */                          \
    X(CB_ERROR_PROFILE, -11)  /* the control's profile or this target cannot do that */  \
    X(CB_ERROR_FORMAT, -12)   /* this box does not read the file's format version */

enum cb_error {
#define CB_X(name, value) name = value,
    CB_ERRORS(CB_X)
#undef CB_X
};

#endif
