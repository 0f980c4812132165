// SPDX-License-Identifier: MIT
// Random files, random PLCs, random everything: what must always hold (firmware/box/box.h) is
// checked in every step against a model that shares no code with the box.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <random>

#include "tests/support/box_fixture.h"

namespace compbox {
namespace {

// ---- chance

struct chance {
    std::mt19937 engine;
    explicit chance(unsigned seed) : engine(seed) {}

    unsigned below(unsigned n) { return static_cast<unsigned>(engine() % n); }
    bool one_in(unsigned n) { return below(n) == 0; }
    double between(double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(engine);
    }
    double log_between(double low, double high) {
        return std::exp(between(std::log(low), std::log(high)));
    }
    uint16_t word() { return static_cast<uint16_t>(engine()); }
};

// ---- numbers in registers, written anew

bool is_wide(unsigned type) {
    return !(type == CB_NUMBER_UINT16 || type == CB_NUMBER_INT16 || type == CB_NUMBER_UINT16_LE ||
             type == CB_NUMBER_INT16_LE);
}
bool is_float(unsigned type) {
    return type == CB_NUMBER_FLOAT32 || type == CB_NUMBER_FLOAT32_CDAB ||
           type == CB_NUMBER_FLOAT32_LE;
}
bool is_signed(unsigned type) {
    return type == CB_NUMBER_INT16 || type == CB_NUMBER_INT16_LE || type == CB_NUMBER_INT32 ||
           type == CB_NUMBER_INT32_CDAB || type == CB_NUMBER_INT32_LE;
}

// Positions of the bytes A (most significant) … D in the stream of bytes on the wire.
std::vector<unsigned> byte_order(unsigned type) {
    switch (type) {
        case CB_NUMBER_UINT32_CDAB:
        case CB_NUMBER_INT32_CDAB:
        case CB_NUMBER_FLOAT32_CDAB:
            return {2, 3, 0, 1};
        case CB_NUMBER_UINT32_LE:
        case CB_NUMBER_INT32_LE:
        case CB_NUMBER_FLOAT32_LE:
            return {3, 2, 1, 0};
        case CB_NUMBER_UINT16_LE:
        case CB_NUMBER_INT16_LE:
            return {1, 0};
        case CB_NUMBER_UINT16:
        case CB_NUMBER_INT16:
            return {0, 1};
        default:
            return {0, 1, 2, 3};
    }
}

double get_number(unsigned type, const uint16_t *registers) {
    const std::vector<unsigned> order = byte_order(type);
    uint64_t bits = 0;
    for (unsigned at : order)
        bits = bits << 8 | (at % 2 ? registers[at / 2] & 0xFFu : registers[at / 2] >> 8);
    if (is_float(type)) {
        const uint32_t narrow = static_cast<uint32_t>(bits);
        float f;
        std::memcpy(&f, &narrow, sizeof f);
        return f;
    }
    const int64_t value = static_cast<int64_t>(bits);
    const int64_t modulus = int64_t{1} << 8 * order.size();
    return static_cast<double>(is_signed(type) && value >= modulus / 2 ? value - modulus : value);
}

void put_number(unsigned type, double number, uint16_t *registers) {
    const std::vector<unsigned> order = byte_order(type);
    uint32_t bits = static_cast<uint32_t>(static_cast<int64_t>(std::llround(
        std::isfinite(number) ? std::clamp(number, -2147483648.0, 4294967295.0) : 0.0)));
    if (is_float(type)) {
        const float f = static_cast<float>(number);
        std::memcpy(&bits, &f, sizeof bits);
    }
    for (unsigned i = 0; i < order.size(); ++i) {
        const unsigned shift = 8 * static_cast<unsigned>(order.size() - 1 - i), at = order[i];
        const unsigned byte = bits >> shift & 0xFFu;
        uint16_t &r = registers[at / 2];
        r = static_cast<uint16_t>(at % 2 ? (r & 0xFF00u) | byte : (r & 0xFFu) | byte << 8);
    }
}

// ---- files

struct curve {
    bool is_polyline;
    std::vector<float> x, y;  // points; or y: coefficients
    double value(double at) const {
        if (!is_polyline) {
            double sum = 0;
            for (std::size_t k = y.size(); k-- > 0;) sum = sum * at + y[k];
            return sum;
        }
        if (at <= x.front()) return y.front();
        for (std::size_t i = 1; i < x.size(); ++i) {
            if (at <= x[i])
                return y[i - 1] + (at - x[i - 1]) / (x[i] - x[i - 1]) * (y[i] - y[i - 1]);
        }
        return y.back();
    }
};

struct random_file {
    config_builder builder;
    std::vector<curve> curves;  // one for each term

    cb_config &config() { return *builder.config; }

    explicit random_file(chance &c) {
        cb_config &f = config();
        f.period_us = static_cast<uint32_t>(c.log_between(1000, 100000));
        f.lead_us = c.one_in(2) ? c.below(200000) : 0;
        f.hold_us = c.one_in(5) ? 0 : c.below(1000000);
        f.ramp_um_per_s = static_cast<float>(c.log_between(1, 1000));
        f.plc.read = {0, 100, c.one_in(2)};
        f.plc.write = {200, 80, c.one_in(2)};
        f.plc.control = 1;
        f.plc.plc_heartbeat = 2;
        f.plc.status = 1;
        f.plc.box_heartbeat = 2;
        f.plc.referenced_mask = static_cast<uint16_t>(c.one_in(2) ? 2 : c.word() & 0xFFF0);
        add_signals(c);
        add_terms(c);
        add_channels(c);
    }

    void add_signals(chance &c) {
        cb_config &f = config();
        for (unsigned n = 1 + c.below(8), i = 0; i < n; ++i) {
            const bool plc = i == 0 || !c.one_in(3);
            const unsigned type = c.below(CB_NUMBER_FLOAT32_LE + 1);
            cb_signal_config &s = builder.signal(("s" + std::to_string(i)).c_str(), "u",
                                                 plc ? CB_SOURCE_PLC : CB_SOURCE_BUS,
                                                 static_cast<cb_number_type>(type), 3 + 2 * i);
            s.scale = static_cast<float>(c.log_between(1e-4, 10)) * (c.one_in(2) ? 1.0f : -1.0f);
            s.zero = c.one_in(2) ? 0 : static_cast<float>(c.between(-100, 100));
            const double span = std::fabs(s.scale) * 1000;
            s.min = s.zero - static_cast<float>(span);
            s.max = s.zero + static_cast<float>(span);
            s.essential = plc && c.one_in(2);
            s.leads = plc && c.one_in(2);
            s.max_rate_per_s = c.one_in(2) ? 0 : static_cast<float>(c.log_between(1, 100) * span);
            s.max_age_ms = f.period_us * (1 + c.below(20)) / 1000 + 1;
        }
    }

    void add_terms(chance &c) {
        for (unsigned n = 1 + c.below(10), i = 0; i < n; ++i) {
            const unsigned of = c.below(config().signals_count);
            const cb_signal_config &s = config().signals[of];
            const std::string name = "t" + std::to_string(i);
            curve drawn = {c.one_in(2), {}, {}};
            if (drawn.is_polyline) {
                for (unsigned k = 0; k < 5; ++k) {
                    drawn.x.push_back(s.min + (s.max - s.min) * static_cast<float>(k) / 4);
                    drawn.y.push_back(static_cast<float>(c.between(-100, 100)));
                }
                builder.polyline(name.c_str(), of, drawn.x, drawn.y);
            } else {
                const float slope = static_cast<float>(c.between(-100, 100)) / (s.max - s.min);
                drawn.y = {static_cast<float>(c.between(-50, 50)) - slope * s.zero, slope};
                builder.polynomial(name.c_str(), of, {drawn.y[0], drawn.y[1]});
            }
            curves.push_back(drawn);
        }
    }

    void add_channels(chance &c) {
        const unsigned types[] = {CB_NUMBER_INT16, CB_NUMBER_INT32, CB_NUMBER_FLOAT32,
                                  CB_NUMBER_INT32_CDAB, CB_NUMBER_INT16_LE};
        cb_config &f = config();
        for (unsigned n = 1 + c.below(6), i = 0; i < n; ++i) {
            cb_channel_config &ch = builder.channel(("c" + std::to_string(i)).c_str(),
                                                    {c.below(f.outputs_count)}, 3 + 2 * i);
            while (c.one_in(2) && ch.sum_count < 8)
                ch.sum[ch.sum_count++] = static_cast<uint8_t>(c.below(f.outputs_count));
            ch.type = static_cast<uint8_t>(types[c.below(5)]);
            ch.sign = c.one_in(2) ? 1 : -1;
            ch.limit_um = static_cast<float>(c.log_between(5, 500));
            ch.error_um = ch.limit_um * static_cast<float>(c.one_in(2) ? 1 : c.between(1, 20));
            ch.slew_um_per_s = f.ramp_um_per_s * static_cast<float>(c.log_between(0.02, 100));
            const double finest = is_wide(ch.type) ? 1e-4 : ch.limit_um / 30000;
            const double coarsest =
                std::max(2 * finest, static_cast<double>(f.ramp_um_per_s) * f.period_us * 0.9e-6);
            ch.scale = static_cast<float>(c.log_between(finest, coarsest));
            ch.deadband_um = c.one_in(3) ? ch.limit_um * 0.02f : 0;
            ch.has_applied = c.one_in(4);
            ch.applied_reg = static_cast<uint16_t>(40 + 2 * i);
        }
        add_pairs(c);
    }

    void add_pairs(chance &c) {
        cb_config &f = config();
        for (unsigned i = 0; i + 1 < f.channels_count; i += 2) {
            const float unit = std::max(f.channels[i].scale, f.channels[i + 1].scale);
            if (c.one_in(2)) continue;
            f.channels[i + 1].has_applied = f.channels[i].has_applied;  // as the loader asks
            builder.pair(i, i + 1, unit + static_cast<float>(c.log_between(1, 200)));
        }
    }

    // Another file for the same machine: other models, limits, rates and pairs, for the same
    // signals and registers.
    void redraw(chance &c) {
        cb_config &f = config();
        f.terms_count = f.outputs_count = f.pairs_count = 0;
        f.pool_count = 0;
        curves.clear();
        add_terms(c);
        f.lead_us = c.one_in(2) ? c.below(200000) : 0;
        f.hold_us = c.one_in(5) ? 0 : c.below(1000000);
        f.ramp_um_per_s = static_cast<float>(c.log_between(1, 1000));
        for (unsigned i = 0; i < f.channels_count; ++i) {
            cb_channel_config &ch = f.channels[i];
            f.ramp_um_per_s =
                std::max(f.ramp_um_per_s, ch.scale * 1.2e6f / static_cast<float>(f.period_us));
            ch.limit_um = static_cast<float>(c.log_between(5, 500));
            if (!is_wide(ch.type)) ch.limit_um = std::min(ch.limit_um, ch.scale * 30000);
            ch.error_um = ch.limit_um * static_cast<float>(c.one_in(2) ? 1 : c.between(1, 20));
            ch.deadband_um = c.one_in(3) ? ch.limit_um * 0.02f : 0;
            ch.sum_count = 0;
            do ch.sum[ch.sum_count++] = static_cast<uint8_t>(c.below(f.outputs_count));
            while (c.one_in(2) && ch.sum_count < 8);
        }
        for (unsigned i = 0; i < f.channels_count; ++i)
            f.channels[i].slew_um_per_s =
                f.ramp_um_per_s * static_cast<float>(c.log_between(0.02, 100));
        add_pairs(c);
    }
};

// ---- the world: PLC, sensors, clock, and what the box must be

struct checked_value {
    double um = 0, time_s = 0;
    bool checked = false;  // false: nothing is promised of the step from here
    double slew = 0;       // um/s: the largest of the files that ran since then
};

// A write without an answer: it may take effect, also behind a later one, until the PLC's program
// ran for so long, or the PLC served requests for so long.
struct timed_write {
    std::vector<checked_value> values;
    double lives_s, serves_s;
};

// Floats that no sound PLC returns.
double wrong_float(chance &c) {
    const double wrong[] = {std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::infinity(),
                            -std::numeric_limits<double>::infinity(),
                            static_cast<double>(std::numeric_limits<float>::max()),
                            -static_cast<double>(std::numeric_limits<float>::max()),
                            static_cast<double>(std::numeric_limits<float>::denorm_min()),
                            c.between(-1e6, 1e6)};
    return wrong[c.below(7)];
}

struct world {
    chance &c;
    random_file &file;
    box_rig rig;
    std::vector<double> raw;  // of each signal, wandering
    std::vector<std::map<int64_t, float>> delivered;
    std::vector<checked_value> plc;
    std::vector<bool> coarse;
    std::vector<timed_write> late;
    std::vector<bool> lied = std::vector<bool>(16);  // of this reading: applied, or the read-back
    uint16_t plc_status = 0;                         // what the PLC's register says of the box
    bool needs_permission = false;                   // a box was at work here before
    unsigned crashes = 0, lates = 0;
    bool lies = true;
    unsigned trouble = 0;     // 0: all good … 4: nothing works
    bool calm = false;        // no more trouble, but …
    bool stopped = false;     // … the PLC's program is stopped
    unsigned unanswered = 0;  // … one write in so many gets no answer
    double true_s = 0;
    int64_t reading_us = std::numeric_limits<int64_t>::min();  // last good one
    int64_t beat_us = reading_us;                              // … in which the heartbeat moved
    uint16_t last_control = 0, last_beat = 0;
    bool heard = false, clock_bad = false, hold_was = false;
    double hold_s = 0;

    world(chance &chance_, random_file &file_)
        : c(chance_), file(file_), rig(file_.builder), raw(64), delivered(64), plc(16), coarse(16) {
        rig.now_us = 1 + c.below(1000000000);
        rig.in.stop = false;
    }
    const cb_config &config() const { return rig.box->config; }

    // What a signal's raw number means, in float32 as the file says.
    float value_of(unsigned i, double number) const {
        return static_cast<float>(number) * config().signals[i].scale + config().signals[i].zero;
    }

    double limits_of_type(unsigned type, double number) const {
        if (is_float(type)) return number;
        const bool is = is_signed(type);
        const double top = is_wide(type) ? 4294967296.0 : 65536.0;
        return std::clamp(std::round(number), is ? -top / 2 : 0, (is ? top / 2 : top) - 1);
    }

    void wander() {
        for (unsigned i = 0; i < config().signals_count; ++i) {
            const double step = c.one_in(50) ? 900 : 2;
            raw[i] = std::clamp(raw[i] + c.between(-step, step), -1020.0, 1020.0);
        }
    }

    void fill_registers() {
        uint16_t *r = rig.in.registers;
        const bool garbage = c.below(20) < trouble;
        for (unsigned i = 0; i < 100; ++i) r[i] = garbage ? c.word() : uint16_t{0};
        for (unsigned i = 0; i < config().signals_count; ++i) {
            const cb_signal_config &s = config().signals[i];
            if (s.source != CB_SOURCE_PLC) continue;
            if (!garbage) put_number(s.type, limits_of_type(s.type, raw[i]), r + s.reg);
            if (is_float(s.type) && c.below(30) < trouble)
                put_number(s.type, std::numeric_limits<double>::quiet_NaN(), r + s.reg);
        }
        for (unsigned i = 0; i < config().channels_count; ++i) {
            const cb_channel_config &ch = config().channels[i];
            lied[i] = lies && ch.has_applied && c.below(40) < trouble;
            if (ch.has_applied) put_held(i, r + ch.applied_reg);
        }
        r[1] = control_word(garbage);
        if (c.below(5) >= trouble && !stopped) ++rig.heartbeat;
        r[2] = rig.heartbeat;
        r[0] = r[99] = c.word();
        if (c.below(20) < trouble) r[99] = c.word();
    }

    // What the PLC has of a channel, or a lie.
    void put_held(unsigned i, uint16_t *registers) {
        const cb_channel_config &ch = config().channels[i];
        put_number(ch.type, lied[i] ? wrong_float(c) : ch.sign * plc[i].um / ch.scale, registers);
    }

    uint16_t control_word(bool garbage) {
        if (garbage) return c.word();
        if (calm && !stopped) return config().plc.referenced_mask;
        const unsigned word = config().plc.referenced_mask | (c.one_in(60) ? 0 : 1) |
                              (c.one_in(2) ? 8 : 0) | (c.one_in(20) ? 4 : 0);
        return static_cast<uint16_t>(c.one_in(100) ? word & ~unsigned{2} : word);
    }

    void fill_samples() {
        rig.in.sample_count = 0;
        for (unsigned n = c.below(4); n > 0; --n) {
            const unsigned i = c.below(config().signals_count + (trouble ? 2 : 0));
            cb_sample &s = rig.in.samples[rig.in.sample_count++];
            s = {static_cast<uint8_t>(i), static_cast<float>(i < 64 ? raw[i] : 0), rig.now_us};
            if (c.below(20) < trouble) s.raw = std::numeric_limits<float>::quiet_NaN();
            if (c.below(20) < trouble) s.time_us += static_cast<int>(c.below(100000)) - 90000;
            if (s.time_us > rig.now_us || i >= config().signals_count) continue;
            if (config().signals[i].source != CB_SOURCE_PLC)
                delivered[i][s.time_us] = value_of(i, s.raw);
        }
    }

    // The model's own note of this reading.
    void note_reading() {
        const uint16_t *r = rig.in.registers;
        const bool torn = config().plc.read.counters && r[0] != r[99];
        if (!rig.in.read_ok || rig.in.read_us > rig.now_us || torn) return;
        for (unsigned i = 0; i < config().signals_count; ++i) {
            const cb_signal_config &s = config().signals[i];
            if (s.source == CB_SOURCE_PLC)
                delivered[i][rig.in.read_us] = value_of(i, get_number(s.type, r + s.reg));
        }
        const bool first = reading_us == std::numeric_limits<int64_t>::min();
        if (!first && r[2] != last_beat) beat_us = rig.in.read_us;
        last_beat = r[2];
        last_control = r[1];
        if ((r[1] & 8) || !(r[1] & 1)) needs_permission = false;
        reading_us = rig.in.read_us;
        heard = true;
    }

    bool lives() const {
        return beat_us != std::numeric_limits<int64_t>::min() &&
               rig.now_us - beat_us <= int64_t{config().plc.heartbeat_timeout_ms} * 1000;
    }

    void pass_time() {
        const double period = config().period_us;
        double gap = c.one_in(10) ? c.between(0, 3) * period : period;
        if (c.below(100) < trouble) gap = c.between(-20, 20) * period;
        if (c.below(500) < trouble) gap = c.between(0, 2e10);
        const int64_t gap_us = std::llround(gap);
        const double gap_s = std::clamp(static_cast<double>(gap_us) * 1e-6, 0.0, 2e-6 * period);
        for (timed_write &write : late) {
            write.lives_s -= lives() ? gap_s : 0;
            write.serves_s -= lives() || rig.in.last_write == CB_TRANSFER_OK ? gap_s : 0;
        }
        rig.now_us += gap_us;
        true_s += std::max(0.0, static_cast<double>(gap_us) * 1e-6);
        rig.in.missed_ticks = gap > 1.5 * period ? c.below(3) : 0;
        clock_bad =
            rig.box->life.started && (gap_us < 0 || gap_us > 5 * int64_t{config().period_us});
        for (unsigned i = 0; i < config().channels_count; ++i) {
            const cb_channel_config &ch = config().channels[i];
            const double slew = ch.slew_um_per_s;
            if (!is_float(ch.type) && slew * gap * 1e-6 < ch.scale) coarse[i] = true;
        }
        if (!clock_bad) return;
        for (auto &values : delivered) values.clear();  // all of them are too old now
        reading_us = beat_us = std::numeric_limits<int64_t>::min();
    }

    void read_back() {
        rig.in.held = CB_TRANSFER_NONE;
        const cb_want want = cb_box_wants_held(rig.box.get());
        if (want == CB_WANT_NOTHING) return;
        if (want == CB_WANT_NOW && c.one_in(30)) return restart();
        const cb_transfer answers[] = {CB_TRANSFER_NONE, CB_TRANSFER_UNKNOWN, CB_TRANSFER_REFUSED,
                                       CB_TRANSFER_OK, CB_TRANSFER_OK};
        rig.in.held = answers[c.below(5)];
        for (unsigned i = 0; i < config().channels_count; ++i) {
            if (!config().channels[i].has_applied) lied[i] = lies && c.below(40) < trouble;
            put_held(i, rig.in.held_registers + config().channels[i].reg);
        }
        rig.in.held_registers[1] = plc_status;
    }
    void restart() {
        for (checked_value &h : plc) h = {0, true_s, h.checked};
        late.clear();
        plc_status = 0;
        if (rig.box->plc.contact == CB_CONTACT_NONE)
            needs_permission = false;  // nothing is left of the box that was at work
        if (trouble > 2) rig.heartbeat = 0;
    }

    // The box begins anew beside a PLC that goes on.
    void crash() {
        rig.in.last_write = CB_TRANSFER_NONE;
        cb_box_start(rig.box.get());
        std::memset(&rig.out, 0, sizeof rig.out);
        std::fill(std::begin(before_um), std::end(before_um), 0.0f);
        std::fill(std::begin(last_sent_um), std::end(last_sent_um), 0.0f);
        for (auto &values : delivered) values.clear();
        reading_us = beat_us = std::numeric_limits<int64_t>::min();
        heard = hold_was = false;
        resyncs = 0;
        late.clear();
        needs_permission = (plc_status & 0xFF) != CB_MODE_STANDBY;
        ++crashes;
    }

    // The outputs were placed in this step: nothing is promised of a step from where the PLC is to
    // where it was reported to be, nor, where it would not report it and there is no `applied`, to
    // zero; nor from a value beyond the limit to the limit.
    void note_place(bool was_known) {
        const bool found = !was_known && rig.box->plc.contact == CB_CONTACT_KNOWN;
        if (!found && rig.box->counters.resyncs == resyncs) return;
        if (rig.in.held == CB_TRANSFER_REFUSED) needs_permission = true;
        for (unsigned i = 0; i < config().channels_count; ++i) {
            const cb_channel_config &ch = config().channels[i];
            const bool blind =
                rig.in.held == CB_TRANSFER_REFUSED && !ch.has_applied && plc[i].um != 0;
            const bool beyond = std::fabs(plc[i].um) > ch.limit_um;
            if (lied[i] || blind || beyond || went_back) plc[i].checked = false;
        }
        for (unsigned p = 0; p < config().pairs_count; ++p) {
            const cb_pair_config &pair = config().pairs[p];
            const double apart = std::fabs(plc[pair.a].um - plc[pair.b].um);
            const bool checked = plc[pair.a].checked && plc[pair.b].checked &&
                                 apart <= pair.max_difference_um * (1 + 1e-6) + unit_of(pair);
            plc[pair.a].checked = plc[pair.b].checked = checked;
        }
        for (unsigned i = 0; i < config().channels_count; ++i)
            if (!plc[i].checked) late.clear();
    }
    bool went_back = false;

    double unit_of(const cb_pair_config &pair) const {
        return static_cast<double>(config().channels[pair.a].scale) +
               static_cast<double>(config().channels[pair.b].scale);
    }

    // How large this was where the outputs went on from in this step: the one before or, when the
    // PLC was heard again, what it has or what was sent to it last.
    template <typename function>
    double was(function size) const {
        if (rig.box->counters.resyncs == resyncs) return size(before_um);
        double has_um[16];
        for (unsigned i = 0; i < 16; ++i) has_um[i] = plc[i].um;
        return std::max<double>(size(has_um), size(last_sent_um));
    }
    float last_sent_um[16] = {};
    uint32_t resyncs = 0;

    // Between two steps, whatever the machine is at.
    unsigned reloads = 0;
    float before_um[16] = {};  // outputs of the step before
    void reload() {
        for (unsigned i = 0; i < config().channels_count; ++i) {
            plc[i].slew = std::max<double>(plc[i].slew, config().channels[i].slew_um_per_s);
        }
        file.redraw(c);
        auto fresh = std::make_unique<cb_box>();
        std::memset(fresh.get(), 0, sizeof *fresh);
        fresh->config = file.config();
        cb_box_start(fresh.get());
        ASSERT_TRUE(cb_box_adopt(fresh.get(), rig.box.get()));
        late.clear();  // what a late write of the file before may still do is not modelled
        rig.box = std::move(fresh);
        ++reloads;
    }

    // The same file with a quarter of the limits: outputs are beyond them for a while.
    void narrow() {
        auto fresh = std::make_unique<cb_box>();
        std::memset(fresh.get(), 0, sizeof *fresh);
        for (unsigned i = 0; i < config().channels_count; ++i)
            file.config().channels[i].limit_um *= 0.25f;
        fresh->config = file.config();
        cb_box_start(fresh.get());
        ASSERT_TRUE(cb_box_adopt(fresh.get(), rig.box.get()));
        rig.box = std::move(fresh);
    }

    void step() {
        if (!calm && c.one_in(60)) trouble = c.below(5);
        wander();
        pass_time();
        rig.in.read_ok = c.below(6) >= trouble;
        rig.in.read_us = rig.now_us - (c.one_in(10) ? c.below(config().period_us) : 0);
        if (c.below(100) < trouble) rig.in.read_us += 1 + c.below(100);
        take_late();
        fill_registers();
        fill_samples();
        read_back();
        const bool was_known = rig.box->plc.contact == CB_CONTACT_KNOWN;
        went_back = rig.box->plc.went_back;
        cb_box_step(rig.box.get(), &rig.in, rig.now_us, &rig.out);
        note_place(was_known);
        note_reading();
        check();
        end_of_write();
    }

    void end_of_write() {
        rig.in.last_write = CB_TRANSFER_NONE;
        if (!rig.out.write) return;
        const bool lost = unanswered > 0 && ++written % unanswered == 0;
        const unsigned fate = c.below(5) < trouble ? 1 + c.below(5) : lost ? 3 + c.below(2) : 0;
        const cb_transfer results[] = {CB_TRANSFER_OK,      CB_TRANSFER_FAILED,
                                       CB_TRANSFER_REFUSED, CB_TRANSFER_UNKNOWN,
                                       CB_TRANSFER_UNKNOWN, CB_TRANSFER_UNKNOWN};
        rig.in.last_write = static_cast<uint8_t>(results[fate]);
        if (fate == 0 || fate >= 4) take();
        if (fate == 3) keep_late();
    }

    unsigned written = 0;

    // The trouble ends, but for the heartbeat or one write in so many; or there is no enable.
    void calm_down() {
        calm = true;
        trouble = 0;
        stopped = c.one_in(2);
        unanswered = stopped && c.one_in(2) ? 0 : 2 + c.below(6);
    }
    bool at_zero() const {
        return std::all_of(before_um, before_um + config().channels_count,
                           [](float um) { return um == 0; });
    }
    // out: after so long every output is zero, where one write in two is confirmed (limiter.c,
    // "Arrival"). A unit that is not a whole part of a step costs up to half of the rate, a pair
    // waits, and the contact takes some periods.
    double arrival_s() const {
        const double period_s = config().period_us * 1e-6;
        const double turns_s = 2 * 4e-6 * cb_limiter_late_us(&config());
        double way_s = 0;
        for (unsigned i = 0; i < config().channels_count; ++i) {
            const cb_channel_config &ch = config().channels[i];
            const double slew = ch.slew_um_per_s;
            const double held = unanswered ? slew * 2 * period_s / turns_s : slew;
            way_s += 2 * ch.limit_um / std::min<double>(config().ramp_um_per_s, held);
        }
        return config().hold_us * 1e-6 + 2 * turns_s + way_s + 50 * period_s;
    }

    // What a write without an answer would do to the PLC, later.
    void keep_late() {
        for (unsigned i = 0; i < config().channels_count; ++i)
            if (!plc[i].checked) return;  // nothing is promised of a step from or to there
        const double late_s = cb_limiter_late_us(&config()) * 1e-6;
        timed_write write = {{}, late_s, 2 * late_s};
        for (unsigned i = 0; i < config().channels_count; ++i)
            write.values.push_back(
                {written_um(i), true_s, true, config().channels[i].slew_um_per_s});
        late.push_back(write);
    }
    double written_um(unsigned i) const {
        const cb_channel_config &ch = config().channels[i];
        return ch.sign * get_number(ch.type, rig.out.registers + ch.reg) *
               static_cast<double>(ch.scale);
    }

    // One of them takes effect, behind later ones.
    void take_late() {
        const auto over = [](const timed_write &w) { return w.lives_s <= 0 || w.serves_s <= 0; };
        while (!late.empty() && over(late.front())) late.erase(late.begin());
        if (late.empty() || !c.one_in(8)) return;
        const timed_write write = late[c.below(static_cast<unsigned>(late.size()))];
        for (unsigned i = 0; i < config().channels_count; ++i) {
            const double between_s = std::fabs(write.values[i].time_s - plc[i].time_s);
            check_change(i, write.values[i].um, std::max(plc[i].slew, write.values[i].slew),
                         between_s);
            plc[i] = {write.values[i].um, write.values[i].time_s, plc[i].checked,
                      std::max(plc[i].slew, write.values[i].slew)};
        }
        ++lates;
    }

    // in: how far apart in time the two were made
    void check_change(unsigned i, double um, double slew_, double elapsed_s) {
        const cb_channel_config &ch = config().channels[i];
        const double slew = std::max<double>(ch.slew_um_per_s, slew_);
        double most = slew * std::min(elapsed_s, 2e-6 * config().period_us);
        const bool regrid = reloads > 0 && !is_float(ch.type);  // counted in units by one file only
        most = (most + (coarse[i] || regrid ? ch.scale : 0)) * (1 + 1e-5) +
               2e-6 * std::max<double>(ch.limit_um, std::fabs(um));
        if (plc[i].checked) {
            ASSERT_LE(std::fabs(um - plc[i].um), most) << "channel " << i << " slew";
        }
    }

    // The PLC takes the registers over.
    void take() {
        for (unsigned i = 0; i < config().channels_count; ++i) {
            const double um = written_um(i);
            check_change(i, um, plc[i].slew, true_s - plc[i].time_s);
            plc[i] = {um, true_s, true};
        }
        plc_status = rig.out.registers[1];
    }

    void check() {
        check_outputs();
        check_signals_and_terms();
        check_mode();
    }

    void check_outputs() {
        for (unsigned i = 0; i < config().channels_count; ++i) {
            const cb_channel_config &ch = config().channels[i];
            const double um = ch.sign * get_number(ch.type, rig.out.registers + ch.reg) *
                              static_cast<double>(ch.scale);
            ASSERT_TRUE(std::isfinite(um));
            const cb_channel_state &state = rig.box->channels[i];
            // what was beyond a new file's limit only comes nearer to it
            const double limit = std::max<double>(
                ch.limit_um, was([i](const auto *at) { return std::fabs(at[i]); }));
            // of another grid; found again, a value beyond the limit is known to a unit
            const bool again = rig.box->counters.resyncs != resyncs;
            const double unit = reloads > 0 ? std::min<double>(ch.scale, again ? 1 : 5e-4) : 0;
            // a lie about a value that was sent of late is believed
            const double sent = lied[i] ? std::max(std::fabs(state.possible_min_um),
                                                   std::fabs(state.possible_max_um))
                                        : 0;
            ASSERT_LE(std::fabs(um), std::max(limit, sent) * (1 + 2e-7) + unit) << "channel " << i;
            ASSERT_NEAR(um, rig.out.channel_um[i], 1e-6 * limit + unit);
        }
        for (unsigned p = 0; p < config().pairs_count; ++p) {
            const cb_pair_config &pair = config().pairs[p];
            const float *um = rig.out.channel_um;
            const double rounding = 1e-6 * (std::fabs(um[pair.a]) + std::fabs(um[pair.b]));
            const double before =
                was([&pair](const auto *at) { return std::fabs(at[pair.a] - at[pair.b]); });
            // a lie about one motor only, which fits what it was sent of late, is believed
            if (lied[pair.a] || lied[pair.b]) continue;
            ASSERT_LE(std::fabs(um[pair.a] - um[pair.b]),
                      std::max<double>(pair.max_difference_um, before + unit_of(pair)) + rounding);
        }
        std::copy_n(rig.out.channel_um, config().channels_count, before_um);
        if (rig.out.write) std::copy_n(rig.out.channel_um, config().channels_count, last_sent_um);
        resyncs = rig.box->counters.resyncs;
        ASSERT_EQ(rig.out.registers[1], rig.box->mode.mode | rig.box->mode.reason << 8);
        if (config().plc.write.counters) {
            ASSERT_EQ(rig.out.registers[0], rig.out.registers[79]);
        }
    }

    // A term that is live has young, plausible signals that were really delivered, and its value is
    // that of its curve. A wish is minus the sum of its outputs.
    void check_signals_and_terms() {
        for (unsigned i = 0; i < config().terms_count; ++i) {
            if (!rig.box->terms[i].live) continue;
            const unsigned of = config().terms[i].as.curve.signal;
            const cb_signal_config &s = config().signals[of];
            const cb_signal_state &state = rig.box->signals[of];
            ASSERT_LE(rig.now_us - state.time_us, int64_t{s.max_age_ms} * 1000);
            const auto source = delivered[of].find(state.time_us);
            ASSERT_NE(source, delivered[of].end()) << "signal " << of;
            ASSERT_GE(state.value, s.min);
            ASSERT_LE(state.value, s.max);
            if (!s.leads) {
                ASSERT_EQ(state.used, state.value);
            }
            ASSERT_NEAR(rig.box->outputs[config().terms[i].first_output],
                        file.curves[i].value(state.used), 1e-2);
        }
        for (unsigned i = 0; i < config().channels_count; ++i) {
            const cb_channel_config &ch = config().channels[i];
            double sum = 0, size = 0;
            for (unsigned k = 0; k < ch.sum_count; ++k) {
                sum += rig.box->outputs[ch.sum[k]];
                size += std::fabs(rig.box->outputs[ch.sum[k]]);
            }
            ASSERT_NEAR(rig.box->channels[i].wanted_um, -sum, 1e-6 * size);
        }
    }

    void check_mode() {
        const bool all_zero =
            std::all_of(rig.out.channel_um, rig.out.channel_um + config().channels_count,
                        [](float um) { return um == 0; });
        if (rig.mode() == CB_MODE_STANDBY || rig.mode() == CB_MODE_STOPPED) {
            ASSERT_TRUE(all_zero);
        }
        if (!heard) {
            ASSERT_FALSE(rig.out.write);
        }
        if (rig.mode() == CB_MODE_ACTIVE) check_active();
        hold_s = rig.mode() == CB_MODE_HOLD && hold_was ? hold_s + last_gap_s() : 0;
        hold_was = rig.mode() == CB_MODE_HOLD;
        ASSERT_LT(hold_s, config().hold_us * 1e-6 + 1e-9);
        last_true_s = true_s;
    }
    double last_true_s = 0;
    double last_gap_s() const { return true_s - last_true_s; }

    void check_active() {
        ASSERT_FALSE(needs_permission);
        ASSERT_FALSE(clock_bad);
        ASSERT_TRUE(last_control & 1);
        ASSERT_EQ(last_control & config().plc.referenced_mask, config().plc.referenced_mask);
        ASSERT_NE(reading_us, std::numeric_limits<int64_t>::min());
        ASSERT_LE(rig.now_us - reading_us, 3 * int64_t{config().period_us});
        ASSERT_NE(beat_us, std::numeric_limits<int64_t>::min());
        ASSERT_LE(rig.now_us - beat_us, int64_t{config().plc.heartbeat_timeout_ms} * 1000);
        for (unsigned i = 0; i < config().signals_count; ++i) {
            const cb_signal_config &s = config().signals[i];
            if (!s.essential) continue;
            ASSERT_LE(rig.now_us - rig.box->signals[i].time_us, int64_t{s.max_age_ms} * 1000);
        }
    }
};

// How often the storm is repeated with other seeds: COMPBOX_STORM=40 makes about 10^7
// cycles.
unsigned storms() {
    const char *wanted = std::getenv("COMPBOX_STORM");
    return wanted ? static_cast<unsigned>(std::stoul(wanted)) : 1;
}

void storm(unsigned seed) {
    chance c(seed);
    unsigned active = 0, written = 0, resyncs = 0, faded = 0, steps = 0, crashes = 0, lates = 0;
    for (unsigned round = 0; round < 250; ++round) {
        SCOPED_TRACE(testing::Message() << "round " << round);
        random_file file(c);
        world w(c, file);
        for (unsigned n = 0; n < 600; ++n, ++steps) {
            if (c.one_in(400)) w.crash();
            w.step();
            if (testing::Test::HasFatalFailure()) FAIL() << "step " << n;
            active += w.rig.mode() == CB_MODE_ACTIVE;
            written += w.rig.out.write;
        }
        crashes += w.crashes;
        lates += w.lates;
        resyncs += w.rig.box->counters.resyncs;
        faded += w.rig.box->counters.terms_faded;
    }
    // The storm must not be so thick that nothing is tested.
    EXPECT_GT(active, steps / 10);
    EXPECT_GT(written, steps / 3);
    EXPECT_GT(resyncs, 300u);
    EXPECT_GT(faded, 300u);
    EXPECT_GT(crashes, 300u);
    EXPECT_GT(lates, 300u);
}

TEST(box_property, all_promises_hold_whatever_happens) {
    for (unsigned n = 0; n < storms(); ++n) {
        SCOPED_TRACE(testing::Message() << "seed " << 20260101 + n);
        storm(20260101 + n);
        if (HasFatalFailure()) return;
    }
}

// A new file between any two steps: nothing steps, and all promises hold again as soon as the
// outputs have come back inside the new limits, from where they were, at the slew rate.
TEST(box_property, all_promises_hold_over_reloads) {
    chance c(20260202);
    unsigned reloads = 0, active = 0, beyond = 0, steps = 0;
    for (unsigned round = 0; round < 150; ++round) {
        SCOPED_TRACE(testing::Message() << "round " << round);
        random_file file(c);
        world w(c, file);
        w.lies = false;  // a lie within the limits of the file before would be believed
        for (unsigned n = 0; n < 600; ++n, ++steps) {
            if (c.one_in(40)) w.reload();
            w.step();
            if (testing::Test::HasFatalFailure()) FAIL() << "step " << n;
            active += w.rig.mode() == CB_MODE_ACTIVE;
            for (unsigned i = 0; i < w.config().channels_count; ++i)
                beyond += std::fabs(w.rig.out.channel_um[i]) > w.config().channels[i].limit_um;
        }
        reloads += w.reloads;
    }
    EXPECT_GT(reloads, 2000u);
    EXPECT_GT(active, steps / 10);
    EXPECT_GT(beyond, 500u);
}

// No output stays for ever.
TEST(box_property, outputs_reach_zero_with_a_dead_heartbeat_and_with_writes_without_an_answer) {
    chance c(20260303);
    unsigned away = 0;
    for (unsigned round = 0; round < 300; ++round) {
        SCOPED_TRACE(testing::Message() << "round " << round);
        random_file file(c);
        cb_config &f = file.config();
        f.period_us = std::max<uint32_t>(f.period_us, 20000);
        for (unsigned i = 0; i < f.channels_count; ++i) {
            cb_channel_config &ch = f.channels[i];
            f.ramp_um_per_s = std::max(f.ramp_um_per_s, ch.limit_um / 5);
            ch.slew_um_per_s = std::max(ch.slew_um_per_s, ch.limit_um / 5);
        }
        world w(c, file);
        w.lies = false;
        for (unsigned n = 0; n < 200; ++n) w.step();
        w.calm_down();
        away += !w.at_zero();
        const double end_s = w.true_s + w.arrival_s();
        while (w.true_s < end_s && (!w.at_zero() || !w.rig.out.write) && !HasFatalFailure())
            w.step();
        if (HasFatalFailure()) return;
        EXPECT_TRUE(w.at_zero() && w.rig.out.write);
    }
    EXPECT_GT(away, 60u);
}

TEST(box_property, stop_takes_no_longer_than_stated_and_a_second) {
    chance c(6);
    for (unsigned round = 0; round < 150; ++round) {
        SCOPED_TRACE(testing::Message() << "round " << round);
        random_file file(c);
        cb_config &f = file.config();
        f.plc.read.counters = false;
        for (unsigned i = 0; i < f.channels_count; ++i) {
            cb_channel_config &ch = f.channels[i];
            f.ramp_um_per_s = std::max(f.ramp_um_per_s, ch.limit_um / 20);
            ch.slew_um_per_s = std::max(ch.slew_um_per_s, ch.limit_um / 20);
        }
        world w(c, file);
        for (unsigned n = 0; n < 200; ++n) w.step();
        if (c.one_in(2)) w.narrow();
        const double period_s = f.period_us * 1e-6;
        const double longest_s = static_cast<double>(cb_box_stop_us(w.rig.box.get())) * 1e-6;
        w.rig.in.stop = true;
        double took_s = 0;
        while (!w.rig.out.stopped && took_s < 2 * longest_s + 10) {
            w.rig.in.held = CB_TRANSFER_REFUSED;
            w.rig.step(f.period_us);
            took_s += period_s;
        }
        EXPECT_LE(took_s, longest_s + 1 + 2 * period_s);
    }
}

}  // namespace
}  // namespace compbox
