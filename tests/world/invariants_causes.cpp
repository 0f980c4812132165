// SPDX-License-Identifier: MIT
// The sentence of a cause in the log is true (docs/faults.md, "The detail word"): the bound is one
// of the file, and the value is beyond it.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <regex>
#include <set>

#include "tests/world/blocks.h"
#include "tests/world/invariants.h"
#include "tests/world/run.h"

namespace compbox::world {

namespace {

class causes_invariant : public invariant {
  public:
    explicit causes_invariant(run &of)
        : invariant(of, "causes"),
          judged_(!draws_any(of, {fault_kind::hostile, fault_kind::memory})),
          names_judged_(judged_ && longest_lag(of) == 0 &&
                        !draws_any(of, {fault_kind::reload, fault_kind::reader})),
          terms_judged_(names_judged_ && !hides_exchanges(of)) {}
    void started() override {
        named_.clear();
        term_.clear();
        detail_ = 0;
    }
    // A missing signal is named in the log, and another one behind it too.
    void exchanged(const exchange &seen) override {
        if (seen.written.empty()) return;
        const machine &facts = of_.author_of(seen);
        const written_block &block = block_of(facts, seen);
        if (terms_judged_ && facts.map.detail) judge_term(facts, block, seen.sent);
        if (judged_ && facts.map.detail && block.reason == box_reason::drifted)
            judge_drifted(facts, block.detail);
        const unsigned detail =
            facts.map.detail && block.reason == box_reason::signal ? block.detail : 0;
        if (detail != detail_) since_ns_ = seen.sent;
        detail_ = detail;
        const std::size_t place = detail & 0xFFu;
        if (!names_judged_ || named_.empty() || place == 0 || place > facts.signals.size() ||
            seen.sent - since_ns_ < 2 * second)
            return;
        const std::string &missing = facts.signals[place - 1].name;
        if (missing != named_)
            violated(fmt::format("{} is missing for two seconds, and the log names {}", missing,
                                 named_));
    }
    void taken(const machine &was, const machine &is) override {
        learn(was);
        learn(is);
    }
    void logged(const std::string &line) override {
        static const std::regex sentence(
            R"((signal|channel) (\S+) (?:reads|wants|is) (\S+) (?:\S+ )?(?:old )?and its (\w+) is (\S+)$)");
        static const std::regex mode(
            R"((STANDBY|ACTIVE|HOLD|RAMP|FAULT|STOPPED): [^:]*(?:: signal (\S+) .*)?$)");
        static const std::regex term(R"(: term (\S+) (?:is faded out|has probes to one side))");
        std::smatch words;
        if (line.find("about the mode left out") != std::string::npos) named_.clear();
        if (std::regex_search(line, words, term)) {
            term_ = words[1];
            term_ns_ = of_.time.now();
        }
        if (std::regex_search(line, words, mode)) named_ = words[2];
        if (!judged_ || !std::regex_search(line, words, sentence)) return;
        learn(of_.running());
        const std::string property = words[4];
        const double value = std::stod(words[3]), bound = std::stod(words[5]);
        const auto &known = bounds_[words[2].str() + " " + property];
        const bool is_known = std::any_of(known.begin(), known.end(), [bound](double one) {
            return std::fabs(one - bound) <= 1e-5 * std::fabs(one);
        });
        if (!is_known)
            violated(fmt::format("no file has this {} for {} {}: {}", property, words[1].str(),
                                 words[2].str(), bound));
        const double near = 1e-5 * std::fabs(bound);  // of six digits
        const double beyond = property == "min"             ? bound - value
                              : words[1].str() == "channel" ? std::fabs(value) - bound
                                                            : value - bound;
        if (beyond < -near)
            violated(fmt::format("{} is within its {} of {}, and is named as the cause: {}",
                                 words[2].str(), property, bound, value));
    }

  private:
    // A term in a line has its name from the detail of a block about then, which counts terms.
    void judge_term(const machine &facts, const written_block &block, time_ns sent) {
        const std::size_t place = block.detail & 0xFFu, kind = block.detail >> 8;
        const bool of_term = place > 0 && (kind == faded || kind == drifted);
        if (of_term && place <= facts.file().at("terms").size()) {
            const nlohmann::json &one = facts.file().at("terms")[place - 1];
            shown_[one.contains("outputs") ? one.at("outputs")[0] : one.at("name")] = sent;
        }
        if (term_.empty() || sent < term_ns_ + 4 * facts.period_us * us) return;
        const auto found = shown_.find(term_);
        if (found == shown_.end() || found->second < term_ns_ - 4 * facts.period_us * us)
            violated(fmt::format("the log names the term {}, and the detail no such one", term_));
        term_.clear();
    }
    // Only a term that adapts has probes.
    void judge_drifted(const machine &facts, std::size_t detail) {
        const std::size_t place = detail & 0xFFu;
        const nlohmann::json &terms = facts.file().at("terms");
        if (place > 0 && place <= terms.size() && terms[place - 1].at("type") == "adapt") return;
        violated(fmt::format("probes are to one side, and the detail is {:#x}", detail));
    }
    static constexpr std::size_t faded = 7, drifted = 12;  // kinds of docs/faults.md
    void learn(const machine &of) {
        if (!judged_) return;
        for (const channel_facts &channel : of.channels) {
            bounds_[channel.name + " limit_um"].insert(channel.limit_um);
            bounds_[channel.name + " error_um"].insert(channel.error_um);
        }
        for (const signal_facts &signal : of.signals) {
            bounds_[signal.name + " min"].insert(signal.min);
            bounds_[signal.name + " max"].insert(signal.max);
            bounds_[signal.name + " max_age_ms"].insert(1e-3 *
                                                        static_cast<double>(signal.max_age_us));
        }
    }

    bool judged_, names_judged_, terms_judged_;
    std::string named_;  // the signal in the newest line of a mode
    std::string term_;   // in a line that is not judged yet
    time_ns term_ns_ = 0;
    std::map<std::string, time_ns> shown_;  // terms by the newest block about them
    unsigned detail_ = 0;
    time_ns since_ns_ = 0;                            // since then it is that one
    std::map<std::string, std::set<double>> bounds_;  // by name and property, of all files so far
};

}  // namespace

void add_causes(run &of, invariants &all) {
    all.push_back(std::make_unique<causes_invariant>(of));
}

}  // namespace compbox::world
