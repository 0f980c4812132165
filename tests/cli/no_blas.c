/* SPDX-License-Identifier: MIT
 * LD_PRELOAD of a command whose figures must not depend on the BLAS and LAPACK of the machine, of
 * which Debian has several: each call ends the program. The names are those that Ceres imports. */
#include <stdlib.h>

/* Fortran's routines and those of C: the arguments do not matter. */
#define ENDS(name)    \
    void name(void);  \
    void name(void) { \
        abort();      \
    }

ENDS(dpotrf_)
ENDS(dpotrs_)
ENDS(dtrtrs_)
ENDS(dormqr_)
ENDS(dgeqrf_)
ENDS(dgels_)
ENDS(dgemm_)
ENDS(dgemv_)
ENDS(dsyrk_)
ENDS(ddot_)
