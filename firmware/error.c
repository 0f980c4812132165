/* SPDX-License-Identifier: MIT */
#include "firmware/error.h"

const char *cb_error_name(enum cb_error error) {
    switch (error) {
#define CB_X(name, value) \
    case name:            \
        return #name;
        CB_ERRORS(CB_X)
#undef CB_X
    }
    return "CB_ERROR_UNKNOWN";
}
