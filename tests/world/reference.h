// SPDX-License-Identifier: MIT
// The box's arithmetic once more, in double precision, by docs/coefficient-file.md alone: from the
// readings that the PLC gave to what each channel wants. It shares no code with the box.
//
// NaN stands for what readings do not tell: sensors on wires of their own, probes, a signal that is
// too old, a lag whose start is in a state file. It spreads to all that depends on it, and nothing
// is judged by it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tests/world/machine.h"
#include "tests/world/scheduler.h"
#include "tests/world/sensor_watch.h"

namespace compbox::world {

struct exchange;

// The smallest and largest input that a trained model takes unchanged, and where it has faded to
// nothing.
struct trained_range {
    double min = -1e30, max = 1e30, margin = 0, fade = 1;
    double held(double x) const { return std::clamp(x, min - margin, max + margin); }
    double weight(double x) const {
        const double beyond = std::max(x - max, min - x) - margin;
        return 1 - std::clamp(beyond / fade, 0.0, 1.0);
    }
};
// out: one for each input of a bank or network that names its training range; else as of no range
std::vector<trained_range> ranges_of(const nlohmann::json &net);
// out: what a lag of a bank is called here
std::string bank_key(const std::string &input, unsigned power, float tau_s);

// out: x multiplied by itself, which takes less time than std::pow()
double power_of(double x, unsigned power);

double polyline_at(const std::vector<double> &at, const std::vector<double> &values, double x);
double bspline_at(const std::vector<double> &knots, std::size_t degree,
                  const std::vector<double> &points, double x);
// Beyond its ends it has the value there.
struct polynomial {
    double from, to, center, half_range;
    std::vector<double> coefficients;
    explicit polynomial(const nlohmann::json &term);
    double at(double x) const;
};
// The error of the tool tip along an axis (0 … 2): the sum of delta_a + 1e-3 eps_a x L_a over the
// axes a, and squareness.
struct volumetric {
    struct part {
        std::string error;
        std::size_t kind;  // 0 … 2: along X, Y, Z; 3 … 5: around them
        double lever_mm[3];
        bool moves[3];  // the position of an axis is a part of its lever
    };
    double b0z_urad, c0y_urad, a0z_urad;
    std::string tool;  // signal of its length; "": it is constant
    std::vector<part> parts;
    explicit volumetric(const nlohmann::json &term);
    // in : the axes' positions; what each part's error is
    double um(std::size_t axis, const std::array<double, 3> &at_mm,
              const std::vector<double> &errors, double tool_mm) const;
};
// One step of a first-order lag y, exact for an input that goes linearly from u to `to` in dt_s.
double lagged(double y, double u, double to, double dt_s, double tau_s);

// A number, and how far the box's may be from it: it looks ahead by times that it measures, and has
// 24 bits.
struct judged_number {
    double value, near;
};

// Of a value; either: it is at the edge of what the box takes.
enum class verdict { taken, refused, either };

class reference_box {
  public:
    explicit reference_box(const machine &of);

    // The daemon has started: its lags begin with the first reading. With a state file they may go
    // on instead.
    void start(bool has_state);
    // The daemon goes on with another file, which has other numbers alone, and another order.
    void take(const machine &of);
    // A whole reading, for which the box sent its request at `sent`.
    void read(const machine &of, const exchange &seen, time_ns sent);
    // A sample of a sensor on a wire of its own.
    void sample(const std::string &signal, double value, time_ns at);
    // Whether the box has the same past: not where values at the edge of what it takes leave more
    // than two.
    bool knows() const { return knows_; }
    // Takes all that was read before `now` for the two below.
    void look(time_ns now);
    // out: minus the sum of the channel's terms; NaN if it is not known
    double wanted_um(std::size_t channel) const { return -sum_of(channel, used_); }
    // The same, and how far the box's may be from it.
    judged_number judged_um(std::size_t channel) const;
    // out: whether a signal is too old for sure
    bool lacks(const std::string &name, time_ns now) const {
        return is_gone(signals_[place_of(name)], now);
    }
    // out: whether a term of the channel has an input that is too old for sure
    bool lacks_input(std::size_t channel, time_ns now) const;
    // The same of these outputs of terms.
    bool lack_input(const std::vector<std::string> &outputs, time_ns now) const;
    // out: a signal that is beyond the training range of a term for sure; nullptr: none
    const std::string *beyond_training() const;
    // out: whether a signal may be too old
    bool may_lack_input(time_ns now) const;
    // Its derivative by a signal, likewise: µm for each mm.
    judged_number judged_slope(std::size_t channel, const std::string &by) const;
    // The position where it was evaluated, likewise.
    judged_number judged_place(const std::string &of) const;
    // The sum of these outputs of terms, likewise.
    judged_number judged(const std::vector<std::string> &outputs) const;
    // out: the value of a reading at that time, if the box accepts it for sure
    std::optional<double> newest(const std::string &signal, time_ns at) const;
    // out: the value of a lag at the newest reading
    judged_number lag_of(const std::string &key) const;
    // out: the sensors that check each other; nullptr: the file has none
    const sensor_watch *watch() const { return watch_ ? &*watch_ : nullptr; }

  private:
    using values = std::vector<double>;  // of signals, then of hidden_
    using function = std::function<double(const values &)>;
    struct signal {
        std::string name;
        double min = 0, max = 0, rate_per_s = 0, unit = 0;
        time_ns max_age_ns = 0;
        bool from_plc = false, leads = false;
        time_ns waits_ns = 0;    // a sample, for the step of the box that takes it, at most
        std::size_t source = 0;  // of a lag the signal behind it, else itself
        std::optional<std::size_t> watched{};  // its place among the sensors that check each other
        // of the newest value that the box accepts
        bool known = false;
        double value = 0, before = 0;
        double at_reading = 0;  // what it was at the newest reading of the PLC
        time_ns at_ns = 0, before_ns = 0;
        double velocity = 0, velocity_near = 0;  // as the box filters it, and how far it may be off
        // Of a position whose velocity the PLC gives: its place, and what 1/s of the position is.
        std::optional<std::size_t> reported;
        double per_s = 1;
        // At the edge of what it takes the box may have kept the value before: so far from this
        // one, and as old.
        double doubt = 0, other = 0;
        time_ns other_ns = 0;
    };
    struct lag {
        std::size_t of, to;  // places in values
        double tau_s;
        unsigned power;
        double min = -1e30, max = 1e30;  // of what it takes of `of`
        std::string key = "";            // that of the same lag in another file
        bool known = false;
        double y = 0, u = 0;
        double x = 0;       // of which u is the power, within min and max
        double before = 0;  // y, by the value before
        double near = 0;    // by the times of samples, of which the box has its own, and by doubt
        double doubt = 0;   // of u
        time_ns at_ns = 0;
    };
    struct play {
        std::size_t of, to;
        double width;
        std::string key;  // likewise
        double near;      // within a reversal
        double x = 0;
        bool known = false;
    };
    std::size_t hidden_place();
    std::size_t place_of(const std::string &name) const;
    void take_signals(const machine &of);
    void take_terms(const nlohmann::json &root);
    function function_of(const nlohmann::json &term, std::size_t k);
    function curve_of(const nlohmann::json &curve) const;
    function play_of(const nlohmann::json &term);
    function linear_of(const nlohmann::json &term, std::size_t k);
    function bank_of(const nlohmann::json &bank, std::size_t k);
    function network_of(const nlohmann::json &net, std::size_t k) const;
    function volumetric_of(const nlohmann::json &term, char axis) const;
    void accept(signal &of, double value, time_ns at);
    void move(signal &of, double change, time_ns at, double doubt) const;
    static verdict judge_range(const signal &of, double value);
    static verdict judge_rate(const signal &of, double change, time_ns apart_ns);
    const lag *ancestor_of(const lag &fresh) const;
    template <typename State>
    void adopt(reference_box &fresh, State &one, const State &was) const;
    void watch_sensors(time_ns now);
    bool is_gone(const signal &one, time_ns now) const;
    judged_number input_of(const signal &of) const;
    double largest_of(std::size_t place) const;
    void follow();
    judged_number velocity_of(const signal &of, time_ns now) const;
    double sum_of(std::size_t channel, const values &at) const;
    template <typename Value>
    double most_change(double value, const Value &value_at) const;
    judged_number judged_sum(const std::vector<function> &outputs) const;
    bool lack_input(const std::vector<function> &outputs, time_ns now) const;
    std::vector<function> functions_of(const std::vector<std::string> &outputs) const;

    std::vector<signal> signals_;
    std::optional<sensor_watch> watch_;
    std::vector<lag> lags_;
    std::vector<play> plays_;
    std::vector<double> hidden_;       // lags of banks, directions
    std::vector<double> hidden_near_;  // how far the box's may be from them
    std::map<std::string, function> outputs_;
    struct trained_input {
        std::size_t place;
        double min, max;
    };
    std::vector<trained_input> trained_;       // of all terms
    std::vector<std::vector<function>> sums_;  // by channel
    values used_, unsure_;  // what the terms take, and how far the box's may be from it
    time_ns period_ns_ = 0;
    double lead_s_ = 0, lead_unsure_s_ = 0;
    bool counts_beats_ = false;           // velocities by the PLC's count …
    double scan_s_ = 0;                   // … of its scans
    std::uint16_t beat_ = 0, beats_ = 0;  // of the newest reading, and since the one before
    time_ns before_ns_ = 0;               // the reading before
    time_ns watched_ns_ = 0;              // readings in a row, in which the box counts beats
    bool knows_ = true, has_state_ = false;
};

}  // namespace compbox::world
