// SPDX-License-Identifier: MIT
// Invariants of every struct cb_config that the loader accepts, checked independently of the
// loader: doubles and plain loops.
#pragma once

extern "C" {
#include "firmware/config/config.h"
#include "firmware/config/rtu_budget.h"
#include "firmware/terms/kinds.h"
#include "firmware/wire/number.h"
}

#include <cmath>
#include <cstring>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace compbox_test {

// The first violated invariant, or an empty text.
class invariants {
  public:
    explicit invariants(const cb_config &config) : c(config) {
        whole_box();
        plc();
        for (int i = 0; i < c.signals_count && i < CB_MAX_SIGNALS; ++i) signal(c.signals[i]);
        for (int i = 0; i < c.terms_count && i < CB_MAX_TERMS; ++i) term(c.terms[i], i);
        for (int i = 0; i < c.channels_count && i < CB_MAX_CHANNELS; ++i) channel(c.channels[i]);
        for (int i = 0; i < c.pairs_count && i < CB_MAX_PAIRS; ++i) pair(c.pairs[i]);
        handshake();
        registers();
        names();
    }
    std::string broken;

  private:
    const cb_config &c;

    void must(bool holds, const std::string &what) {
        if (!holds && broken.empty()) broken = what;
    }
    static bool within(double x, double least, double most) { return x >= least && x <= most; }
    template <size_t N>
    static bool ends(const char (&text)[N]) {
        return std::memchr(text, 0, N) != nullptr;
    }
    static int width(int type) {
        return type == CB_NUMBER_UINT16 || type == CB_NUMBER_INT16 || type == CB_NUMBER_UINT16_LE ||
                       type == CB_NUMBER_INT16_LE
                   ? 1
                   : 2;
    }

    void serial(const cb_serial_config &s) {
        must(ends(s.device) && std::strncmp(s.device, "/dev/", 5) == 0, "device");
        must(cb_is_usual_baud(s.line.baud), "baud");
        must(s.line.parity <= CB_PARITY_ODD && within(s.line.stop_bits, 1, 2), "parity, stop bits");
        must(s.slave_delay_us <= 1000000, "slave delay");
    }

    void whole_box() {
        must(within(c.period_us, 1000, 1000000), "period");
        must(c.lead_us <= 500000 && !(c.lead_measured && c.lead_us > 0), "lead");
        must(c.hold_us <= 60000000, "hold");
        must(within(c.ramp_um_per_s, 1e-3f, 1e6), "ramp");
        must(within(c.signals_count, 1, CB_MAX_SIGNALS), "signals_count");
        must(within(c.terms_count, 1, CB_MAX_TERMS), "terms_count");
        must(within(c.outputs_count, c.terms_count, CB_MAX_OUTPUTS), "outputs_count");
        must(within(c.channels_count, 1, CB_MAX_CHANNELS), "channels_count");
        must(c.pairs_count <= CB_MAX_PAIRS, "pairs_count");
        must(c.pool_count <= CB_POOL_FLOATS, "pool_count");
        must(ends(c.machine), "machine");
        for (int i = 0; i < c.pool_count && i < CB_POOL_FLOATS; ++i)
            must(std::isfinite(c.pool[i]), "pool is finite");
    }

    // Profile, exchange, transport, places and times of the PLC are consistent with each other.
    void plc() {
        const cb_plc_config &p = c.plc;
        must(p.profile <= CB_PROFILE_FANUC && p.exchange <= CB_EXCHANGE_FC23, "profile, exchange");
        must(!(p.profile == CB_PROFILE_SINUMERIK_840D && p.exchange == CB_EXCHANGE_FC23),
             "no fc23");
        if (p.transport == CB_TRANSPORT_RTU) {
            serial(p.serial);
            must(within(p.unit, 1, 247), "unit");
            must(cb_rtu_longest_us(&p, &p.serial.line) <= cb_exchange_budget_us(c.period_us),
                 "the line carries the exchange");
        } else {
            must(p.transport == CB_TRANSPORT_TCP, "transport");
            must(ends(p.host) && std::strlen(p.host) >= 2, "host");
            must(std::strspn(p.host, "0123456789abcdefABCDEF.:") == std::strlen(p.host), "host");
            must(p.port >= 1, "port");
            must(p.client <= CB_CLIENT_LIBMODBUS, "client");
        }
        must(c.buses_count <= CB_MAX_BUSES, "buses");
        for (int i = 0; i < c.buses_count && broken.empty(); ++i) serial(c.buses[i].serial);
        must(within(p.read.count, 2, CB_MAX_READ_REGISTERS), "read count");
        must(within(p.write.count, 2, CB_MAX_WRITE_REGISTERS), "write count");
        must(p.read.start + p.read.count <= 65536 && p.write.start + p.write.count <= 65536,
             "ends");
        must(p.control < p.read.count && p.plc_heartbeat < p.read.count, "in the read block");
        must(p.status < p.write.count && p.box_heartbeat < p.write.count, "in the write block");
        must(within(p.heartbeat_timeout_ms * 1000.0, c.period_us, 60e6), "heartbeat timeout");
        must(p.referenced_mask != 0 && (p.referenced_mask & 0x000D) == 0, "referenced bits");
    }

    // Keys of an NC with handshake, which no other has (docs/plc-profiles.md).
    void handshake() {
        const cb_plc_config &p = c.plc;
        must(within(p.deadband_um, 0, 1000), "deadband of the PLC");
        if (p.profile != CB_PROFILE_FANUC) {
            must(!p.has_handshake && !p.axes_at_once && p.scan_us == 0 && p.step_units == 0,
                 "no handshake");
            return;
        }
        must(within(p.scan_us, 100, 1000000) && within(p.step_units, 2, 9998), "scan, step");
        const double round_s = 4e-6 * p.scan_us * (p.axes_at_once ? 1 : c.channels_count);
        for (int i = 0; i < c.channels_count; ++i) {
            const cb_channel_config &ch = c.channels[i];
            must(ch.type == CB_NUMBER_INT16 || ch.type == CB_NUMBER_INT32 ||
                     ch.type == CB_NUMBER_INT32_CDAB,
                 "whole increments");
            must(!ch.tangent && ch.limit_um < 9999.5 * ch.scale, "within 9999 increments");
            const double step_um = p.step_units * static_cast<double>(ch.scale);
            const double window_s = std::fmax(1.0, 10 * round_s);
            must(ch.slew_um_per_s * window_s + ch.scale <= step_um * (1 + 1e-5), "steps");
            must(!ch.has_applied || std::fabs(ch.step_um - step_um) <= 1e-5 * step_um, "step_um");
        }
    }

    // in : s, one signal of the configuration
    // out: broken, if a number is out of range or a field of its source is wrong
    void signal(const cb_signal_config &s) {
        must(s.source <= CB_SOURCE_HAND && s.type <= CB_NUMBER_INT8, "source, type");
        must(ends(s.unit), "unit");
        must(std::fabs(s.scale) >= 1e-12f && std::fabs(s.scale) <= 1e6f, "scale");
        must(within(s.zero, -1e9, 1e9), "zero");
        must(within(s.min, -1e9, 1e9) && within(s.max, -1e9, 1e9) && s.min < s.max, "min, max");
        must(s.max_rate_per_s == 0 || within(s.max_rate_per_s, 1e-6f, 1e9), "rate");
        must(within(s.max_age_ms, 1, 86400000), "age");
        must(std::isfinite(4294967295.0f * s.scale + s.zero), "the largest reading is finite");
        const bool mm = !std::strcmp(s.unit, "mm") || !std::strcmp(s.unit, "deg");
        must(s.leads == (mm && s.source == CB_SOURCE_PLC), "leads");
        if (s.source == CB_SOURCE_LAG) {
            lag(s);
        } else if (s.source == CB_SOURCE_CAN) {
            must((s.can_id & 0x7fffffffu) <= 0x1fffffffu, "can id");
            must((s.can_id >> 31) == ((s.can_id & 0x7fffffffu) > 0x7ff), "29-bit mark");
            must(s.reg + 2 * width(s.type) <= 8, "inside the frame");
        } else if (s.source == CB_SOURCE_BUS) {
            must(within(s.bus_unit, 1, 247) && s.bus < c.buses_count, "bus unit");
            must(s.reg + width(s.type) <= 65536, "bus register");
        } else if (s.source == CB_SOURCE_HAND) {
            must(s.can_id != 0 && s.bus <= CB_HAND_COUNT, "name and part");
        } else {
            must(s.reg + width(s.type) <= c.plc.read.count, "inside the read block");
        }
    }

    // A lag occurs once in the order of lags, after its signal, and has that signal's range and
    // age.
    void lag(const cb_signal_config &s) {
        must(within(s.tau_s, 1e-3f, 86400) && (s.power == 1 || s.power == 2), "tau, power");
        must(s.lag_of < c.signals_count && c.lags_count <= c.signals_count, "what a lag follows");
        if (!broken.empty()) return;
        const cb_signal_config &u = c.signals[s.lag_of];
        int own = -1, of = u.source == CB_SOURCE_LAG ? CB_MAX_SIGNALS : -1;
        for (int i = c.lags_count - 1; i >= 0; --i) {
            if (&c.signals[c.lags[i]] == &s) own = i;
            if (c.lags[i] == s.lag_of) of = i;
        }
        must(own >= 0 && of < own, "lags come after what they follow");
        must(s.max_age_ms == u.max_age_ms && !s.essential, "age and importance of a lag");
        const double most = std::fmax(std::fabs(u.min), std::fabs(u.max));
        must(s.power == 1 ? s.min == u.min && s.max == u.max
                          : s.min >= 0 && s.max == static_cast<float>(most * most),
             "range of a lag");
    }

    // Horner's scheme over absolute values in double: no step in float32 can exceed it by much.
    static double bound(const float *a, int degree, double u, bool slope) {
        double sum = 0;
        for (int k = degree; k >= (slope ? 1 : 0); --k)
            sum = sum * u + std::fabs(static_cast<double>(a[k])) * (slope ? k : 1);
        return sum;
    }

    // in : t and its index
    // out: broken, if its outputs, its curve or its own fields are wrong
    void term(const cb_term_config &t, int index) {
        const cb_curve_config &curve = t.as.curve;
        must(t.type < CB_TERM_TYPES && within(t.outputs, 1, 8), "term type, outputs");
        must(t.first_output + t.outputs <= c.outputs_count, "outputs");
        for (int k = 0; broken.empty() && k < t.outputs; ++k)
            must(c.outputs[t.first_output + k].term == index, "outputs belong to terms");
        if (!broken.empty()) return;
        if (t.type == CB_TERM_LINEAR && t.as.linear.has_bank) return bank(t);
        if (t.type == CB_TERM_LINEAR) return linear(t.as.linear);
        if (t.type == CB_TERM_PRODUCT) return product(t.as.product, index);
        if (t.type == CB_TERM_BPNET) return network(t);
        if (t.type == CB_TERM_VOLUMETRIC) return volumetric(t.as.volumetric, index);
        if (t.type == CB_TERM_ADAPT) return adapt(t, index);
        must(curve.signal < c.signals_count, "the curve's signal");
        one_curve(t, curve);
        if (!broken.empty() || curve.reversal_mm == 0) return;
        must(curve.reversal_mm >= 1e-3f && curve.reversal_mm <= 1e3f, "reversal");
        must(curve.backward < c.branches_count && c.branches_count <= CB_MAX_BRANCHES, "backward");
        if (!broken.empty()) return;
        must(c.branches[curve.backward].signal == curve.signal, "both branches of one signal");
        one_curve(t, c.branches[curve.backward]);
    }

    void one_curve(const cb_term_config &t, const cb_curve_config &curve) {
        must(curve.spans >= 1, "spans");
        if (t.type == CB_TERM_POLYNOMIAL) {
            polynomial(curve);
        } else {
            pieces(t, curve);
        }
    }

    void inputs(int link, int count) {
        must(count >= 1 && link + count <= c.links_count && c.links_count <= CB_MAX_LINKS, "links");
        for (int i = 0; broken.empty() && i < count; ++i)
            must(c.links[link + i] < c.signals_count, "an input is a signal");
    }

    // An output in use belongs to an earlier term.
    void uses(int output, int index) {
        must(output < c.outputs_count, "a used output");
        must(broken.empty() && c.outputs[output].term < index, "terms come after what they use");
    }

    void linear(const cb_linear_config &l) {
        inputs(l.inputs.link, l.inputs.count);
        must(l.pool + l.inputs.count + 1 <= c.pool_count, "inside the pool");
        if (!broken.empty()) return;
        double most = std::fabs(c.pool[l.pool + l.inputs.count]);
        for (int i = 0; i < l.inputs.count; ++i) {
            const cb_signal_config &s = c.signals[c.links[l.inputs.link + i]];
            most += std::fabs(static_cast<double>(c.pool[l.pool + i])) *
                    std::fmax(std::fabs(s.min), std::fabs(s.max));
        }
        must(most < 1.1e9, "a sum stays below 1e9");
    }

    // Each bank has its own lags and columns, whose sums cannot overflow.
    void bank(const cb_term_config &t) {
        must(t.as.linear.bank < c.banks_count && c.banks_count <= CB_MAX_BANKS, "bank");
        if (!broken.empty()) return;
        const cb_bank_config &b = c.banks[t.as.linear.bank];
        inputs(b.inputs.link, b.inputs.count);
        must(b.inputs.link + 2 * b.inputs.count <= c.links_count, "powers");
        must(within(b.taus_count, 1, CB_MAX_BANK_TAUS), "time constants");
        must(b.taus + b.taus_count <= t.as.linear.pool, "time constants, then weights");
        if (!broken.empty()) return;
        for (int i = 0; i < b.taus_count; ++i) {
            const float tau_s = c.pool[b.taus + i];
            must(i == 0 || tau_s > c.pool[b.taus + i - 1], "time constants ascend");
            must((i == 0 && b.unlagged) ? tau_s == 0 : within(tau_s, 1e-3f, 86400), "tau_s");
        }
        std::vector<double> sizes;
        for (int i = 0; i < b.inputs.count; ++i) {
            const cb_signal_config &s = c.signals[c.links[b.inputs.link + i]];
            const int set = c.links[b.inputs.link + b.inputs.count + i];
            must(within(set, 1, 15), "a set of powers");
            const double x = std::fmax(std::fabs(s.min), std::fabs(s.max));
            for (int p = 1; p <= 4; ++p)
                if (set >> (p - 1) & 1) sizes.insert(sizes.end(), b.taus_count, std::pow(x, p));
            if (!b.trained) continue;
            const float *range = c.pool + b.ranges + 4 * i;
            must(range[0] <= range[1] && range[2] >= 0 && range[3] > 0, "training range");
        }
        const size_t lagged = static_cast<size_t>(b.taus_count - b.unlagged);
        must(b.lags + sizes.size() / b.taus_count * lagged <= c.bank_lags_count &&
                 c.bank_lags_count <= CB_MAX_BANK_LAGS,
             "lags of a bank");
        must(t.as.linear.pool + t.outputs * (sizes.size() + 1) <= c.pool_count, "weights");
        for (size_t k = 0; broken.empty() && k < t.outputs; ++k) {
            const float *weights = c.pool + t.as.linear.pool + k * sizes.size();
            double most = 0;
            for (size_t i = 0; i < sizes.size(); ++i)
                most += std::fabs(static_cast<double>(weights[i])) * sizes[i];
            must(most < 1.1e9, "a sum stays below 1e9");
        }
        if (b.model != 0) sigma(t, b, sizes);
    }

    // in : sizes: the largest value of each column
    void sigma(const cb_term_config &t, const cb_bank_config &b, const std::vector<double> &sizes) {
        must(b.outputs == t.outputs, "outputs of a sigma");
        must(within(b.directions, 1, CB_MAX_DIRECTIONS), "directions");
        const size_t offsets = b.sigma + size_t{2} * b.outputs;
        must(offsets + b.directions * (sizes.size() + 1) <= c.pool_count, "sigma");
        if (!broken.empty()) return;
        for (int k = 0; k < 2 * b.outputs; ++k)
            must(within(c.pool[b.sigma + k], 0, 1e6), "floor, along");
        for (size_t d = 0; d < b.directions; ++d) {
            const float *weights = c.pool + offsets + b.directions + d * sizes.size();
            double most = std::fabs(static_cast<double>(c.pool[offsets + d]));
            for (size_t i = 0; i < sizes.size(); ++i)
                most += std::fabs(static_cast<double>(weights[i])) * sizes[i];
            must(most < 1.1e9, "a place stays below 1e9");
        }
    }

    void product(const cb_product_config &p, int index) {
        must(p.signal < c.signals_count && within(p.origin, -1e9, 1e9), "factor, origin");
        uses(p.output, index);
    }

    // Its channel has it in the sum, and no other channel has; its model is not in that sum.
    void adapt(const cb_term_config &t, int index) {
        const cb_adapt_config &a = t.as.adapt;
        uses(a.output, index);
        must(a.signals[0] < c.signals_count && a.signals[1] < c.signals_count, "probe");
        const int channel = cb_adapt_channel(&a);
        must(channel < c.channels_count || (channel == CB_NONE && cb_adapt_is_whole(&a)),
             "its channel");
        must(within(a.settings.bias_max_um, 0, 1000) && within(a.settings.gain_max, 0, 1),
             "bounds of an adapted term");
        must(a.settings.step_max_um > 0 && a.settings.sigma_um > 0, "step, sigma");
        for (int i = 0; broken.empty() && i < c.channels_count; ++i) {
            bool own = false, model = false;
            for (int k = 0; k < c.channels[i].sum_count; ++k) {
                own = own || c.channels[i].sum[k] == t.first_output;
                model = model || c.channels[i].sum[k] == a.output;
            }
            must(own == (i == channel) && !(own && model), "a sum with an adapted term");
        }
    }

    void network(const cb_term_config &t) {
        const cb_bpnet_config &n = t.as.bpnet;
        must(within(n.inputs.count, 1, 64) && within(n.hidden, 1, 64), "size of a network");
        inputs(n.inputs.link, n.inputs.count);
        const int units = (n.hidden + 3) / 4 * 4;
        const int row = 1 + units + (n.linear ? n.inputs.count : 0);
        must(n.weights + units * (n.inputs.count + 1) + t.outputs * row <= c.pool_count, "weights");
        must(n.ranges + 4 * n.inputs.count <= c.pool_count, "ranges");
        for (int i = 0; broken.empty() && i < n.inputs.count; ++i) {
            const float *range = c.pool + n.ranges + 4 * i;
            must(range[0] <= range[1] && range[2] >= 0 && range[3] > 0, "training range");
        }
    }

    void volumetric(const cb_volumetric_config &v, int index) {
        must(v.pool + 17 <= c.pool_count, "inside the pool");
        must(v.signals[3] == CB_NONE || v.signals[3] < c.signals_count, "tool length");
        for (int a = 0; a < 3; ++a) {
            must(v.signals[a] < c.signals_count, "position");
            must(reinterpret_cast<const unsigned char *>(c.pool + v.pool + 15)[a] < 8, "moves");
        }
        for (const int error : v.error) {
            if (error != CB_NONE) uses(error, index);
        }
    }

    void polynomial(const cb_curve_config &p) {
        must(p.degree <= 15 && p.pool + p.degree + 1 <= c.pool_count, "inside the pool");
        must(p.inverse_half_range > 0 && std::isfinite(p.inverse_half_range), "half range");
        must(std::isfinite(p.center) && p.from < p.to, "center, from, to");
        must(within(p.from, -1e9, 1e9) && within(p.to, -1e9, 1e9), "range");
        if (!broken.empty()) return;
        const double u = std::fmax(std::fabs(static_cast<double>(p.from) - p.center),
                                   std::fabs(static_cast<double>(p.to) - p.center)) *
                         p.inverse_half_range;
        must(bound(c.pool + p.pool, p.degree, u, false) < 1.1e9, "polynomial stays below 1e9");
        must(bound(c.pool + p.pool, p.degree, u, true) * p.inverse_half_range < 3.4e38,
             "its slope");
    }

    void pieces(const cb_term_config &t, const cb_curve_config &p) {
        must(within(p.degree, 1, t.type == CB_TERM_POLYLINE ? 1 : 5), "degree");
        must(p.pool + p.spans + 1 + p.spans * (p.degree + 1) <= c.pool_count, "inside the pool");
        must(p.spans_per_unit >= 0 && std::isfinite(p.spans_per_unit), "spans per unit");
        if (!broken.empty()) return;
        const float *breaks = c.pool + p.pool, *a = breaks + p.spans + 1;
        for (int i = 0; i < p.spans; ++i, a += p.degree + 1) {
            must(breaks[i] < breaks[i + 1], "breaks ascend");
            const double u = static_cast<double>(breaks[i + 1]) - breaks[i];
            must(bound(a, p.degree, u, false) < 3.4e38 && bound(a, p.degree, u, true) < 3.4e38,
                 "no step of a curve overflows");
        }
    }

    void channel(const cb_channel_config &ch) {
        must(within(ch.sum_count, 1, CB_MAX_SUM), "sum_count");
        std::set<int> once;
        for (int i = 0; i < ch.sum_count && i < CB_MAX_SUM; ++i) {
            must(ch.sum[i] < c.outputs_count, "sum");
            must(once.insert(ch.sum[i]).second, "an output is summed once");
        }
        must(ch.sign == 1 || ch.sign == -1, "sign");
        if (ch.tangent) tangent(ch);
        must(within(ch.limit_um, 1e-3f, 1e6) && within(ch.error_um, ch.limit_um, 1e6), "limits");
        const bool lowered = c.plc.step_units > 0;  // by the control's largest step
        must(within(ch.slew_um_per_s, lowered ? 1e-9f : 1e-3f, 1e6), "slew");
        must(within(ch.deadband_um, 0, ch.limit_um), "deadband");
        const double units = static_cast<double>(ch.limit_um) / ch.scale;
        const bool small = width(ch.type) == 1;
        const bool real = ch.type == CB_NUMBER_FLOAT32 || ch.type == CB_NUMBER_FLOAT32_CDAB ||
                          ch.type == CB_NUMBER_FLOAT32_LE;
        must(within(ch.scale, 1e-6f, real ? 1e6f : ch.limit_um), "scale");
        const std::set<int> unsigned_types = {CB_NUMBER_UINT16, CB_NUMBER_UINT32,
                                              CB_NUMBER_UINT32_CDAB, CB_NUMBER_UINT16_LE,
                                              CB_NUMBER_UINT32_LE};
        must(unsigned_types.count(ch.type) == 0, "channels are signed");
        must(real || units < (small ? 32767.5 : 2147484160.0), "limit fits the register");
    }

    // A slope comes after the channels of the file, and belongs to one of them.
    void tangent(const cb_channel_config &ch) {
        must(ch.slope >= c.channels_count && ch.slope < c.channels_count + c.slopes_count &&
                 c.channels_count + c.slopes_count <= CB_MAX_CHANNELS,
             "place of a slope");
        if (!broken.empty()) return;
        const cb_channel_config &slope = c.channels[ch.slope];
        must(slope.is_slope && slope.sum_count == 0 && slope.sign == ch.sign, "slope");
        must(within(slope.limit_um, 0.99, 1.001e5) && slope.scale > 0, "slope limit");
        must(slope.slew_um_per_s >= slope.limit_um, "slope slew");
        must(ch.tangent_signal < c.signals_count && c.signals[ch.tangent_signal].leads, "own axis");
        must(ch.reference_scale > 0, "reference");
    }

    void pair(const cb_pair_config &p) {
        must(p.a < c.channels_count && p.b < c.channels_count && p.a != p.b, "pair");
        must(within(p.max_difference_um, 1e-3f, 1e6), "max_difference");
        int uses = 0;
        for (int i = 0; i < c.pairs_count; ++i) {
            uses += c.pairs[i].a == p.a || c.pairs[i].b == p.a;
            uses += c.pairs[i].a == p.b || c.pairs[i].b == p.b;
        }
        must(uses == 2, "a channel is in one pair");
    }

    // Each register of a block with its user: written ones have one; read ones have one, or several
    // that read the same number.
    void registers() {
        if (!broken.empty()) return;
        std::vector<std::string> reads(c.plc.read.count), writes(c.plc.write.count);
        const auto take = [&](std::vector<std::string> &block, int reg, int count,
                              const std::string &user) {
            for (int i = reg; i < reg + count; ++i) {
                must(i < static_cast<int>(block.size()), user + " is inside its block");
                if (!broken.empty()) return;
                std::string &holder = block[static_cast<size_t>(i)];
                must(holder.empty() || holder == user, holder + " and " + user);
                holder = user;
            }
        };
        if (c.plc.read.counters) take(reads, 0, 1, "first counter");
        if (c.plc.read.counters) take(reads, c.plc.read.count - 1, 1, "last counter");
        if (c.plc.write.counters) take(writes, 0, 1, "first counter");
        if (c.plc.write.counters) take(writes, c.plc.write.count - 1, 1, "last counter");
        take(reads, c.plc.control, 1, "control");
        take(reads, c.plc.plc_heartbeat, 1, "plc_heartbeat");
        if (c.plc.has_handshake) take(reads, c.plc.handshake, 1, "handshake");
        take(writes, c.plc.status, 1, "status");
        take(writes, c.plc.box_heartbeat, 1, "box_heartbeat");
        const auto number = [](int reg, int type) {
            return "number " + std::to_string(reg) + " of type " + std::to_string(type);
        };
        for (int i = 0; i < c.signals_count; ++i) {
            const cb_signal_config &s = c.signals[i];
            if (s.source == CB_SOURCE_PLC) take(reads, s.reg, width(s.type), number(s.reg, s.type));
        }
        for (int i = 0; i < c.channels_count; ++i) {
            const cb_channel_config &ch = c.channels[i];
            take(writes, ch.reg, width(ch.type), "channel " + std::to_string(i));
            if (ch.tangent) {
                const cb_channel_config &slope = c.channels[ch.slope];
                take(writes, slope.reg, width(slope.type), "slope " + std::to_string(i));
                take(writes, ch.reference_reg, width(ch.reference_type),
                     "reference " + std::to_string(i));
            }
            if (!ch.has_applied) continue;
            take(reads, ch.applied_reg, width(ch.type), "applied of channel " + std::to_string(i));
        }
    }

    template <class T>
    void unique(const T *array, int count, const std::string &what) {
        std::set<std::string> seen;
        for (int i = 0; i < count; ++i) {
            must(ends(array[i].name) && array[i].name[0] != '\0', what + " have names");
            if (!broken.empty()) return;
            must(seen.insert(array[i].name).second, what + " have different names");
        }
    }

    void names() {
        if (!broken.empty()) return;
        unique(c.signals, c.signals_count, "signals");
        unique(c.outputs, c.outputs_count, "outputs");
        unique(c.channels, c.channels_count, "channels");
    }
};

}  // namespace compbox_test
