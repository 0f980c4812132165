/* SPDX-License-Identifier: MIT */
#include "firmware/base/cause.h"

struct cb_cause_words cb_cause_words_of(uint8_t kind) {
    switch ((enum cb_cause_kind)kind) {
#define CB_X(name, number, what, before, between) \
    case name:                                    \
        return (struct cb_cause_words){what, before, between};
        CB_CAUSES(CB_X)
#undef CB_X
    }
    return (struct cb_cause_words){"", "a cause that this version does not know", ""};
}
