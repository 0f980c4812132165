// SPDX-License-Identifier: MIT
// Any bytes as a coefficient file: what the loader accepts is sound, and the box runs on it.
// With clang this is a libFuzzer target (scripts/fuzz); otherwise replay_main.cpp feeds it files.
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "tests/support/config_drive.h"
#include "tests/support/config_fixture.h"
#include "tests/support/config_invariants.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void complain(const char *what, const std::string &broken) {
    if (broken.empty()) return;
    std::fprintf(stderr, "%s: %s\n", what, broken.c_str());
    std::abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const auto got = compbox_test::load(std::string(reinterpret_cast<const char *>(data), size));
    if (got.error != CB_OK) {
        complain("no message", got.text.empty() ? compbox_test::error_name(got.error) : "");
        return 0;
    }
    complain("invariant", compbox_test::invariants(*got.config).broken);
    complain("box", compbox_test::drive(*got.config, static_cast<uint32_t>(size)).broken);
    return 0;
}
