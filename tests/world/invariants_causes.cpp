// SPDX-License-Identifier: MIT
// The sentence of a cause in the log is true (docs/faults.md, "The detail word"): the bound is one
// of the file, and the value is beyond it.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <regex>
#include <set>
#include <utility>
#include <vector>

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
        applied_um_.clear();
        in_fault_ = false;
        detail_ = 0;
    }
    void exchanged(const exchange &seen) override {
        if (!seen.written.empty()) judge_block(seen);
        const machine &facts = of_.running_at(seen.sent);
        if (!names_judged_ || seen.duration == never || !is_reading(facts, seen)) return;
        std::vector<double> applied_um;
        for (std::size_t c = 0; c < facts.channels.size(); ++c)
            applied_um.push_back(applied_in(facts, c, seen));
        applied_um_.push_back(applied_um);
        if (applied_um_.size() > most_readings) applied_um_.pop_front();
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
    // A missing signal is named in the log, and another one behind it too.
    void judge_block(const exchange &seen) {
        const machine &facts = of_.author_of(seen);
        const written_block &block = block_of(facts, seen);
        if (terms_judged_ && facts.map.detail) judge_term(facts, block, seen.sent);
        if (judged_ && facts.map.detail && block.reason == box_reason::drifted)
            judge_drifted(facts, block.detail);
        if (names_judged_ && facts.map.detail && block.reason == box_reason::degraded &&
            block.detail >> 8 == doubted)
            judge_doubted(facts, block.detail);
        // Another device may have taken the first blocks of a fault, of other readings.
        const time_ns apart_ns = seen.sent - std::exchange(block_ns_, seen.sent);
        if (names_judged_ && facts.map.detail)
            judge_foreign(facts, block, apart_ns <= 3 * facts.period_us * us);
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
    // The channel of a fault by a value of another client applies one beyond its error_um.
    // in : follows: the block comes right behind the one before
    void judge_foreign(const machine &facts, const written_block &block, bool follows) {
        const bool is_fault = block.mode == fakeplc::box_mode::fault;
        const bool was_fault = std::exchange(in_fault_, is_fault);
        const std::size_t place = block.detail & 0xFFu, kind = block.detail >> 8;
        if (!follows || !is_fault || was_fault || kind != foreign || place == 0 ||
            place > facts.channels.size())
            return;
        const channel_facts &named = facts.channels[place - 1];
        const bool is_beyond = std::any_of(
            applied_um_.begin(), applied_um_.end(), [&named, place](const auto &applied_um) {
                return place > applied_um.size() ||
                       !(std::fabs(applied_um[place - 1]) <= named.error_um);
            });
        if (!is_beyond && !applied_um_.empty())
            violated(
                fmt::format("FAULT by another client's value names {}, whose PLC applies "
                            "{} um within {}",
                            named.name, applied_um_.back()[place - 1], named.error_um));
    }
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
    // Only a sensor that others check is doubted.
    void judge_doubted(const machine &facts, std::size_t detail) {
        const std::size_t place = detail & 0xFFu;
        const nlohmann::json &file = facts.file();
        const nlohmann::json checked =
            file.contains("sensors") ? file.at("sensors").at("signals") : nlohmann::json::array();
        if (place > 0 && place <= facts.signals.size() &&
            std::count(checked.begin(), checked.end(), facts.signals[place - 1].name) > 0)
            return;
        violated(
            fmt::format("a sensor is doubted, the detail is {:#x}, and none checks it", detail));
    }
    // Kinds of docs/faults.md.
    static constexpr std::size_t faded = 7, foreign = 10, doubted = 11, drifted = 12;
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
    static constexpr std::size_t most_readings = 4;
    std::deque<std::vector<double>> applied_um_;  // of the newest readings, by channel
    bool in_fault_ = false;                       // by the newest block …
    time_ns block_ns_ = 0;                        // … which was sent then
    unsigned detail_ = 0;
    time_ns since_ns_ = 0;                            // since then it is that one
    std::map<std::string, std::set<double>> bounds_;  // by name and property, of all files so far
};

}  // namespace

void add_causes(run &of, invariants &all) {
    all.push_back(std::make_unique<causes_invariant>(of));
}

}  // namespace compbox::world
