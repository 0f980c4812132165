// SPDX-License-Identifier: MIT
// Invariant: the box's loader takes what docs/coefficient-file.md allows, and refuses what it
// forbids, beside the files that the run itself brings.
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string>

#include "host-tools/coefficients/load.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"
#include "tests/world/wrong_file.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::world {

namespace {

class loading : public invariant {
  public:
    explicit loading(run &of) : invariant(of, "loading") {}

    void started() override {
        if (looked_) return;
        looked_ = true;
        dice own(of_.options.seed, "loading");
        for (unsigned i = 0; i < files; ++i) {
            const std::string good = i == 0 ? of_.box_machine.text : random_machine(own).text;
            const std::string rare = rare_file(good, own);
            cb_message message = {};
            if (coefficients::load_coefficient_text(rare, &message) == nullptr)
                return violated(fmt::format("refused although it is allowed: {}, line {}",
                                            message.text, message.line));
            for (unsigned j = 0; j < mistakes; ++j) {
                const std::string wrong = wrong_file(rare, own);
                if (coefficients::load_coefficient_text(wrong, &message) != nullptr)
                    return violated("loaded in spite of " + difference(rare, wrong));
            }
        }
    }

  private:
    static constexpr unsigned files = 2, mistakes = 6;

    // out: a line about where the second begins to be another
    static std::string difference(const std::string &one, const std::string &other) {
        const auto ends = std::mismatch(one.begin(), one.end(), other.begin(), other.end());
        const auto at = static_cast<std::size_t>(ends.second - other.begin());
        std::string around = other.substr(at < 40 ? 0 : at - 40, 120);
        for (char &each : around)
            if (each == '\n') each = ' ';
        return fmt::format("a mistake at byte {}: …{}…", at, around);
    }

    bool looked_ = false;
};

}  // namespace

void add_loading(run &of, invariants &all) {
    all.push_back(std::make_unique<loading>(of));
}

}  // namespace compbox::world
