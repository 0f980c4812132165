// SPDX-License-Identifier: MIT
// Invariants at the edges of what they judge: runs that were judged wrongly pass, and a defect that
// is planted into the same run's daemon is found.
#include "tests/world/invariants.h"

#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "host-tools/coefficients/load.h"
#include "host-tools/formats/json_type.h"
#include "tests/world/isolated.h"
#include "tests/world/run.h"
#include "tests/world/wrong_file.h"

extern "C" {
#include "firmware/box/box.h"
#include "firmware/config/config.h"
#include "hal/linux/daemon/loop.h"
}

namespace compbox::world {
namespace {

using defect = std::function<void(cb_loop &)>;

// Calls it each millisecond while the loop steps.
void plant(run &world, const defect &what) {
    world.time.at(world.time.now() + ms, [&world, what] {
        auto *const loop = static_cast<cb_loop *>(world.box.argument_of("compboxd-loop"));
        if (loop != nullptr && loop->made > 0) what(*loop);
        plant(world, what);
    });
}

// A change of the configuration that the daemon's own check of its memory knows.
template <typename Change>
defect to_config(Change change) {
    return [change, known = std::uint32_t{0}](cb_loop &loop) mutable {
        cb_box &box = *loop.box;
        if (box.config_sum == known) return;
        change(box.config);
        cb_box_take_sums(&box);
        box.sum_so_far = box.words_checked = 0;
        known = box.config_sum;
    };
}

template <typename Change>
defect to_channels(Change change) {
    return to_config([change](cb_config &config) {
        for (unsigned i = 0; i < cb_all_channels(&config); ++i) change(config.channels[i]);
    });
}

// What the PLC applies is never outside for long enough.
void no_applied(cb_config &config) {
    config.applied_quarter_us = 1000000000;
}

// A probe of the whole error is taken for one of what is left of it, or the other way round.
void whole_errors(cb_config &config) {
    for (unsigned i = 0; i < config.adapts_count; ++i)
        config.terms[config.adapts[i]].as.adapt.measures |= CB_ADAPT_WHOLE;
}

// No file is ever taken.
void no_offer(cb_loop &loop) {
    loop.offer = CB_LOOP_OFFER_NONE;
}

struct edge {
    const char *invariant;
    std::uint64_t seed, cycles;
    const char *faults;
    defect planted;  // none: another line has it, or docs/results/mutants.md
};

const edge edges[] = {
    // A lag takes over the state of one with another range, and a later file has a bank again.
    {"reference", 4, 4600, "reload", nullptr},
    // A signal that the file before did not have has no value yet.
    {"counters", 44, 5200, "reload", nullptr},
    // The last cut of a torn row was interrupted: a defect of the product.
    {"record", 207, 400, "all", nullptr},
    // A request whose length has changed on the wire is two.
    {"order", 1000448, 1700, "delay,wire", nullptr},
    // A line takes one of the two silences before a request, and noise hits the reading again.
    {"order", 1000009, 3200, "line", nullptr},
    // A read-back takes the time of the first write on a slow line.
    {"counters", 1000170, 100, "none", nullptr},
    // What a sensor gave before it was doubted accused the others: a defect of the product.
    {"doubts", 35002574, 500, "sensors", nullptr},
    // Another reason hides that a term is faded out.
    {"adapted", 35001274, 400, "loss,power_cut,foreign,plc_stop,can", nullptr},
    // A control with a largest step has a slower rate.
    {"progress", 35001676, 200, "loss", nullptr},
    // STOPPED had no reply; each write was refused; a second contact was refused, too.
    {"permission", 5000107, 4700, "restart,exception", nullptr},
    {"permission", 148, 800, "restart,exception", nullptr},
    // A sensor that was doubted may be trusted by now, and doubted again.
    {"doubts", 35003333, 1900, "sensors", nullptr},
    // Behind a probe there is no time to repeat a damaged reading.
    {"order", 35002782, 9100, "line", nullptr},
    // A flood of frames takes the place of two values in a row.
    {"snapshot", 35004144, 16800, "enable,can", nullptr},
    // The sensors of a long run are where no sensor is expected.
    {"rows", 35003020, 20000, "loss,plc_stop", nullptr},
    // A power cut left the file of events under both of its names.
    {"events", 52, 300, "power_cut,restart", nullptr},
    // Behind a start a signal has had no value yet, and another reason hides that.
    {"adapted", 36000868, 11400, "kill,foreign", nullptr},
    // At the edge of its rate the box may have taken another value of a signal.
    {"probes", 1000052, 1400, "sensors", nullptr},
    // One input is back while another one is missing.
    {"fading", 1000146, 900, "sensors", nullptr},
    // Without readings the box does not know what a control with a largest step applies.
    {"retreat", 34000307, 17900, "exception,restart,mute", nullptr},
    // Without `applied` a control's largest step changes the slew rate alone.
    {"reload", 52, 600, "reload", nullptr},
    // A write had its reply too late, and the box goes on from what the PLC applies.
    {"slew", 31000653, 6500, "tear,state,memory,wire,foreign,sensors,boundary,stray", nullptr},
    // FC23 writes the outputs of the step before a reload to a slower file.
    {"slew", 301015, 4000, "partial,power_cut,hostile,foreign,stray",
     to_channels([](cb_channel_config &channel) { channel.slew_um_per_s *= 3; })},
    // A slope is judged while its axis moves.
    {"reference", 6000012, 1000, "enable",
     to_channels([](cb_channel_config &channel) { channel.tangent = false; })},
    // One motor of a stage is five times slower than the other.
    {"models", 37, 6000, "state", to_channels([](cb_channel_config &channel) {
         if (!channel.is_slope) channel.deadband_um = channel.limit_um;
     })},
    // A kill ends a FAULT, too.
    {"models", 1131, 4000, "kill,slow", nullptr},
    {"models", 1193, 4000, "kill,slow",
     to_channels([](cb_channel_config &channel) { channel.error_um = 1e9F; })},
    // With FC23 a step behind a late exchange is followed by a write in time.
    {"status", 311306, 3000, "tear,partial,kill,hostile,wire,line,reader,mute",
     to_config([](cb_config &config) { config.ramp_um_per_s *= 3; })},
    // Between two writes of HOLD the PLC refused all others.
    {"status", 311843, 20000, "exception,partial",
     to_config([](cb_config &config) { config.hold_us = 60000000; })},
    // Torn readings have no reply; a refused probe of a serial line is in a write's place.
    {"statistics", 14, 6000, "exception,enable,mute",
     [](cb_loop &loop) { loop.box->counters.reads_torn = 0; }},
    // A refusal behind two probes of a serial line is uncertain.
    {"counters", 6000814, 20000, "exception",
     [](cb_loop &loop) { loop.box->counters.writes_refused = 0; }},
    // A write on a connection that the box has given up acts behind the next one, and is read back.
    {"counters", 6013, 2500, "delay,loss",
     [](cb_loop &loop) { loop.box->counters.registers_foreign = 1; }},
    // A flood of files fills the events, and another file takes their name.
    {"events", 427, 2500, "reload,sensors", nullptr},
    // The thread that writes events stands for longer than a stop waits.
    {"events", 2119, 2500, "tear,twice,enable,power_cut,restart,state,stall,can", nullptr},
    // No source has given a value since the power came back.
    {"snapshot", 829, 2500, "power_cut,reload", nullptr},
    // A module that was silent for a minute: what it gave before is in a file of the moment before.
    {"snapshot", 2900061, 2500, "reload,sensors", nullptr},
    // A speed of 60 m/min has its limit within the rounding of a larger number.
    {"counters", 1105, 2500, "sensors", nullptr},
    // A position that is no number for two seconds leaves a product where it was.
    {"fading", 749, 2500, "sensors", nullptr},
    // Where an event ended the file before, the next one's minute begins with its first row.
    {"rows", 760031, 2500, "loss", nullptr},
    // Resets of connections lengthen the exchanges that a lead is measured by.
    {"statistics", 780139, 2500, "reset", nullptr},
    // While it waits for a late reply the loop's thread stands still, until long behind the deadline.
    {"tick", 800078, 2500,
     "preempt,delay,reset,exception,disk,reload,state,clock,stall,memory,wire,line,slow,reader", nullptr},
    // A cycle of the PLC takes longer than a period and its own length: no beat, and an axis that moves.
    {"reference", 830026, 2500, "disk", nullptr},
    // A refused rename leaves a number of the records out.
    {"record", 850136, 2500, "refuse", nullptr},
    {"record", 448, 4000, "refuse", nullptr},
    {"rows", 265, 4000, "refuse", nullptr},
    // A filter begins anew, and its first probe brings it to what it had in the run before.
    {"adapted", 852010, 2500, "refuse,kill,power_cut,restart,disk,reload,state,reader,links", nullptr},
    // The line that says how the run before ended could not be written.
    {"state", 840097, 2500, "tear,reset,partial,power_cut,restart,reload,can,stray", nullptr},
    // A disk hangs until just before the end, and the ring of rows is full.
    {"account", 830117, 2500, "disk", nullptr},
    // The bus is off when the daemon starts, and its first start commands are lost.
    {"nodes", 853121, 2500, "power_cut,can", nullptr},
    {"nodes", 854516, 2500, "restart,can", nullptr},
    // The interface goes down behind the last cycle.
    {"statistics", 854222, 2500, "restart,can", nullptr},
    // Within its first second a box does not know how long a beat takes.
    {"reference", 854282, 2500, "restart,can", nullptr},
    // A read-back has a cycle for itself, whose time counts too.
    {"account", 862149, 2500, "plc_stop,slow,mute", nullptr},
    // A disk hangs while the daemon starts, and the loop begins ten seconds later.
    {"rows", 897396, 2500, "restart,disk,sensors", nullptr},
    // A full disk tears a row, and the call that cuts it off is refused.
    {"record", 896343, 2500, "all", nullptr},
    // A probe at a model of 92 um leaves a variance of 0.03 um^2 there of 172.
    {"probes", 897346, 2500, "clock", nullptr},
    // The file of events takes another name less than a second before a power cut.
    {"events", 912251, 1500, "power_cut,restart,enable", nullptr},
    // A thermometer's sample comes behind the reading of a probe, and before its step.
    {"probes", 912348, 1500, "power_cut,restart,enable", nullptr},
    // What a limited step leaves pending is known as well as its model value.
    {"probes", 141418, 200, "sensors,can", nullptr},
    // The thread that writes events stands still to the end, and nobody reads the line about it.
    {"events", 950086, 2500, "preempt,kill,restart,clock,stall,stray,reader", nullptr},
    // A lie within the rounding of the range: the look-ahead may lead to anywhere.
    {"reference", 942064, 2500, "sensors", nullptr},
    // A bus that is off does not go off again.
    {"nodes", 4005, 2500, "can", nullptr},
    // A lag is missing for as long as its source.
    {"fading", 942, 2500, "power_cut,sensors,can,links", nullptr},
    // By FC23 the box steps behind the read-back.
    {"reference", 5142, 2500, "kill,restart", nullptr},
    // A FANUC control applies another client's value, from which its window of steps does not reach.
    {"retreat", 1252, 2500, "preempt,clock,foreign", nullptr},
    // The temperature moves on while no reading comes, and the sigma is that of a second ago.
    {"sigma", 5158, 2500, "loss,mute", nullptr},
    // The machine is suspended before the first step of a daemon.
    {"statistics", 8000231, 20000, "restart,suspend",
     [](cb_loop &loop) { loop.box->counters.clock_jumps = 0; }},
    // A second reply does not hold back those behind it.
    {"look back", 310531, 6000, "twice,clock,mute",
     [](cb_loop &loop) { loop.box->plc.silent = true; }},
    // Short writes take the serial line away, and the PLC is not read for some periods.
    {"silence", 310798, 3000, "preempt,partial,restart,clock,links,mute", nullptr},
    {"silence", 12, 1500, "mute",
     [](cb_loop &loop) {
         cb_plc_state &plc = loop.box->plc;
         if (plc.unconfirmed_us > 3 * loop.box->config.period_us) plc.readable = false;
     }},
    // The reply to a probe comes when the next one is sent, and counts for that.
    {"order", 738, 1950, "slow", nullptr},
    // The heartbeat stood for most of a second in which the box counts it.
    {"statistics", 470, 700, "plc_stop",
     [](cb_loop &loop) { loop.box->life.lead.update_us = 200000; }},
    // A wait that ends a period late is repeated, for as long as it does.
    {"overrun", 310963, 6000, "delay,reset,stall,stray,reader",
     [](cb_loop &loop) { loop.box->life.overrun_score = 0; }},
    // The operator who puts all right keeps enable off until a wider file is taken.
    {"reload", 310603, 6000,
     "preempt,delay,tear,reset,twice,exception,partial,kill,power_cut,restart,disk,reload,state,"
     "suspend,wire,plc_stop,stray",
     nullptr},
    {"reload", 101131, 5000,
     "delay,reset,twice,enable,power_cut,restart,reload,state,stall,plc_stop,boundary,reader",
     nullptr},
    {"reload", 6000645, 6000, "reload", no_offer},
    {"settled file", 8, 6000, "reload", no_offer},
    // Another file has its signals and terms in another order.
    {"snapshot", 900039, 2500, "reload",
     [](cb_loop &loop) {
         for (cb_row &row : loop.rows) row.signals[0].value += 5;
     }},
    // The daemon measures its lead in the first second.
    {"probes", 48, 2000, "none", to_config(whole_errors)},
    // A sample that the box has not taken yet is old behind a long silence.
    {"reference", 23, 2000, "sensors",
     to_channels([](cb_channel_config &channel) { channel.deadband_um = channel.limit_um; })},
    // A lag of a sample that the box has not taken yet.
    {"reference", 7019, 400, "none",
     to_channels([](cb_channel_config &channel) { channel.deadband_um = channel.limit_um; })},
    // The first sample of a daemon comes soon behind the last one of the daemon before.
    {"reference", 7041, 160, "kill,sensors", nullptr},
    // Two samples come between the box's step and its write.
    {"reference", 1157, 300, "none",
     to_channels([](cb_channel_config &channel) { channel.deadband_um = channel.limit_um; })},
    // A signal has a value again, for a time between two snapshots.
    {"fading", 1370, 2500, "tear,enable,power_cut,foreign", nullptr},
    // What was synchronised stays behind a power cut.
    {"events", 780037, 4000, "restart,power_cut", nullptr},
    // A daemon that is stopped before its first write leaves STOPPED to the next one.
    {"permission", 5000477, 1400,
     "preempt,tear,exception,partial,restart,clock,stall,foreign,can,boundary,reader,links",
     [](cb_loop &loop) { loop.box->mode.lost = false; }},
    // Behind a silence the PLC may apply what the last write before it had.
    {"applied", 5000377, 20000, "foreign", to_config(no_applied)},
    // Behind a reload, too, what the file before sent.
    {"applied", 6000865, 6000, "reload,foreign", to_config(no_applied)},
    // Lags go on behind a restart with the pause since their file, by the clock of this boot.
    {"lags", 224, 2500, "power_cut,reader", nullptr},
    {"lags", 230, 2500, "power_cut,reader",
     [](cb_loop &loop) {
         for (cb_signal_state &signal : loop.box->signals) signal.lag.hi += 0.01F;
     }},
    // A sensor that is far off falls silent, and no other is doubted for it.
    {"doubts", 448, 100, "sensors", nullptr},
    // The PLC's velocity is as old as it may be, behind a jump of its position.
    {"reference", 350, 1000, "sensors", nullptr},
    // A PLC that goes on from one tangent to the next where a position jumps there and back.
    {"applied", 319, 1900, "sensors", nullptr},
    // The one that keeps a line of the log back is another term than the first of a sum.
    {"causes", 534, 2500, "twice,kill,can,stray", nullptr},
    // A signal interrupts the reading of the events' last line.
    {"exit", 588, 2500, "partial,restart,can,slow", nullptr},
    // A box that stays in FAULT by the demand of a bad file, while the good one is pending.
    {"service", 14, 2500, "hostile", nullptr},
    // A line of the log whose write is refused.
    {"contents", 158, 100, "refuse,reload", nullptr},
    // A repeated write is no step of its own.
    {"permission", 2570, 2500, "loss,restart,suspend,foreign,slow,mute", nullptr},
    // A pause behind a look back, in which contact is lost: that look places no output.
    {"slew", 2712, 60, "loss,restart,suspend,foreign,slow,mute", nullptr},
    // A power cut tears the first line of the record, and the next start fails.
    {"contents", 142499, 2500,
     "preempt,reset,twice,partial,power_cut,restart,reload,state,clock,suspend,stall,foreign,mute",
     nullptr},
    // A file that goes to zero for an hour is asked to stop, and runs at the end of the faults.
    {"exit", 123076, 2500, "restart,hostile,state", nullptr},
    // A later file checks one sensor fewer.
    {"service", 132679, 2500, "all", nullptr},
    // A sample of CAN comes between the reading and the step, and a lag of 21 ms follows it.
    {"reference", 35003634, 2500, "sensors", nullptr},
    // Behind a suspend nobody is known to be trusted; one without a value is predicted, no doubt.
    {"doubts", 34000840, 3800, "sensors", nullptr},
    // Two probes take the filter there and back, and the term is one of them behind.
    {"adapted", 37000513, 5250, "none", nullptr},
    // A suspend comes between a read-back and the step: it says nothing of what the PLC holds now.
    {"slew", 20388, 2500, "suspend", nullptr},
    // A sensor is right again just behind its doubt, and its prediction has its place.
    {"doubts", 37200091, 500, "sensors", nullptr},
    // A serial adapter comes and goes, and more states of the bus than the ring of reports holds.
    {"modules", 5091, 3000, "line", nullptr},
    // Behind a gap the box begins with what the PLC held, and that counts as sent.
    {"applied", 6006, 3000, "foreign", nullptr},
    // A file without a bank's lag runs between two that have it.
    {"lags", 6022, 3000, "loss,exception,reload,can", nullptr},
    // The reply to a write takes 12 ms on a serial line, and belongs to the lead.
    {"statistics", 36000818, 2500, "sensors", nullptr},
    // A volumetric term needs each position, also one that its output does not depend on.
    {"reference", 3088, 2500, "sensors", nullptr},
    // Another device took the first blocks of a FAULT.
    {"causes", 8130, 2500, "foreign,stray", nullptr},
    // A real is applied a few picometres beside what was sent.
    {"reason", 31000037, 200, "none", nullptr},
    // Nobody reads the log, so FAULT has no line.
    {"refused", 31000803, 900, "exception,reader", nullptr},
    // The drift makes the gain of a probe as uncertain as the time of its step.
    {"probes", 31000429, 60, "twice", nullptr},
    // Of a node's two frames one is rightly left to the other.
    {"reference", 31000531, 2200, "kill", nullptr},
    // A kill right behind a SIGHUP and its event.
    {"events", 9834, 2500, "reload,kill", nullptr},
    // Before its first block a box has sent zero.
    {"applied", 31000208, 2400, "kill,state,foreign", nullptr},
    // A start cut the torn end of the record, and its rows are on the disk.
    {"record", 8420, 2500, "power_cut", nullptr},
    // The line about FAULT 18 comes behind the first write that is accepted again.
    {"refused", 8544, 2500, "exception", nullptr},
    // A control with a largest step stands, and the output stays near what it applies.
    {"retreat", 8590, 2500, "exception,plc_stop", nullptr},
    // A disk hangs; the files behind it have the mode of their time.
    {"report", 9000001, 5300, "exception,disk",
     [](cb_loop &loop) {
         for (cb_row &row : loop.rows) row.mode = CB_MODE_ACTIVE;
     }},
    // A long file of events is rotated.
    {"events", 5000657, 9500,
     "delay,twice,kill,restart,reload,hostile,memory,wire,sensors,line,can,mute", nullptr},
    // A late write of RAMP comes behind the confirmed one of STOPPED.
    {"state", 59, 5000, "delay,twice,exception,refuse",
     [](cb_loop &loop) {
         if (loop.box->mode.reason != CB_REASON_STOP) return;
         loop.box->life.stop_confirmed = true;
         cb_flag_raise(&loop.quit);
     }},
    // The log asks for a restart with the good file: another address of the PLC goes on.
    {"service", 300996, 6000, "tear,exception,restart,hostile,state,wire,mute",
     to_config([](cb_config &config) { config.plc.heartbeat_timeout_ms = 0; })},
    // Sensors that check each other come with a later file.
    {"reference", 2091, 2500, "reload,sensors", nullptr},
    {"reference", 62678, 2500, "reload", nullptr},
    // A probe that is not taken leaves the place of the one before.
    {"probes", 1756, 2500, "enable,can", nullptr},
    // A deadband holds a demand of less than a nanometre at zero.
    {"snapshot", 1808, 2500, "kill,sensors", nullptr},
    // Statistics of another order of nodes come late.
    {"counters", 4699, 2500,
     "preempt,loss,twice,exception,refuse,partial,reload,suspend,foreign,sensors,plc_stop,can,"
     "boundary,reader",
     nullptr},
    // A full disk refuses to cut off a torn row until the daemon ends.
    {"record", 4335, 2500, "all", nullptr},
    // What an adapted term has learnt is beyond the bounds of the next file.
    {"adapted", 404, 2500, "reload", nullptr},
    // What a PLC applies moves on between the read-back and the first write, a cycle later.
    {"outage", 12, 2510, "plc_stop,reader", nullptr},
    // Behind a contact the PLC applies zero, and its register has an old value: a defect of the
    // product. A bus sends as soon as its device is open: another one.
    {"reload", 15, 5060, "loss,reload,line", nullptr},
    {"gap", 101236, 10, "delay,hostile,sensors", nullptr},
    // A reply to the file before comes while its successor opens the device.
    {"gap", 143548, 110, "tear,kill,restart,reload,line", nullptr},
    // Of two banks with the same lag and other ranges one is gone, and comes back.
    {"lags", 103060, 2310, "enable,reload,sensors", nullptr},
    // The first sample of a bus comes just before a reading.
    {"reference", 111364, 140, "sensors", nullptr},
    // That a file waits is one of the lines that were left out.
    {"events", 120331, 2510, "enable,reload,boundary", nullptr},
    // A sigma of a second ago is at its minimum.
    {"sigma", 101912, 1410, "state", nullptr},
};

void PrintTo(const edge &of, std::ostream *out) {
    *out << of.invariant << " of seed " << of.seed;
}

run_options options_of(const edge &of) {
    run_options options;
    options.seed = of.seed;
    options.cycles = of.cycles;
    options.faults = fault_set_of(of.faults);
    return options;
}

class edges_of_invariants : public testing::TestWithParam<edge> {};

TEST_P(edges_of_invariants, the_unchanged_daemon_passes) {
    const run_result result = run_isolated(options_of(GetParam()));
    for (const violation &found : result.violations)
        ADD_FAILURE() << found.invariant << ": " << found.words;
}

TEST_P(edges_of_invariants, a_planted_defect_is_found) {
    run_options options = options_of(GetParam());
    if (!GetParam().planted) return;
    options.prepare = [](run &world) { plant(world, GetParam().planted); };
    const run_result result = run_isolated(options);
    ASSERT_EQ(result.violations.size(), 1u);
    EXPECT_EQ(result.violations[0].invariant, GetParam().invariant) << result.violations[0].words;
}

INSTANTIATE_TEST_SUITE_P(world, edges_of_invariants, testing::ValuesIn(edges));

TEST(events, a_file_that_lost_its_lines_is_found) {
    run_options options;
    options.seed = 1;  // an odd one has events
    options.prepare = [](run &world) {
        world.time.at(20 * second, [&world] { world.box.files.replace(run::events_path, "\n"); });
    };
    const run_result result = run_isolated(options);
    ASSERT_EQ(result.violations.size(), 1u);
    EXPECT_EQ(result.violations[0].invariant, "events");
}

// ---- the reference

struct wrong_arithmetic {
    const char *name;
    defect planted;
    const char *faults = "none";
    const char *invariant = "reference";
    std::uint64_t start = 1;  // the first daemon that has it
};

template <typename Change>
defect to_signals(Change change) {
    return to_config([change](cb_config &config) {
        for (unsigned i = 0; i < config.signals_count; ++i) change(config.signals[i]);
    });
}

template <typename Change>
defect to_filters(Change change) {
    return to_config([change](cb_config &config) {
        for (unsigned i = 0; i < config.adapts_count; ++i)
            change(config.terms[config.adapts[i]].as.adapt.settings);
    });
}

const wrong_arithmetic arithmetic[] = {
    {"no_deadband", to_channels([](cb_channel_config &channel) { channel.deadband_um = 0; })},
    {"a_coarser_deadband",
     to_channels([](cb_channel_config &channel) { channel.deadband_um += 0.5F; })},
    {"a_slower_slew",
     to_channels([](cb_channel_config &channel) { channel.slew_um_per_s *= 0.8F; })},
    {"a_scale_off_by_a_thousandth", to_signals([](cb_signal_config &one) { one.scale *= 1.001F; })},
    {"a_zero_that_is_not_zero", to_signals([](cb_signal_config &one) { one.zero += 0.5F; })},
    {"no_look_ahead", to_signals([](cb_signal_config &one) { one.leads = false; })},
    {"a_demand_beyond_its_error",
     to_channels([](cb_channel_config &channel) { channel.error_um = 1e9F; })},
    {"a_lag_of_twice_the_time", to_config([](cb_config &config) {
         for (unsigned i = 0; i < config.lags_count; ++i) config.lag_links[i].tau_s *= 2;
     })},
    {"another_number_of_a_curve", to_config([](cb_config &config) {
         for (float &number : config.pool) number *= 1.002F;
     })},
    {"a_position_beyond_its_range", to_signals([](cb_signal_config &one) {
         if (one.leads) one.max += 1000;
     }),
     "sensors"},
    {"no_largest_rate", to_signals([](cb_signal_config &one) { one.rate_per_s = 1e9F; }),
     "sensors"},
    {"a_slower_slew_behind_reloads",
     to_channels([](cb_channel_config &channel) { channel.slew_um_per_s *= 0.8F; }), "reload"},
    {"a_zero_that_is_not_zero_behind_a_restart",
     to_signals([](cb_signal_config &one) { one.zero += 0.5F; }), "restart", "reference", 2},
    {"a_noisier_probe", to_filters([](cb_adapt_settings &with) { with.sigma_um *= 2; }), "none",
     "probes"},
    {"a_longer_step", to_filters([](cb_adapt_settings &with) { with.step_max_um *= 2; }), "none",
     "probes"},
    {"a_probe_of_the_whole_error", to_config(whole_errors), "none", "probes"},
    {"a_velocity_of_another_unit",
     to_signals([](cb_signal_config &one) { one.velocity_scale *= 60; })},
    {"a_doubt_after_twice_its_time",
     to_config([](cb_config &config) { config.sensors.after_us *= 2; }), "sensors", "doubts"},
    {"a_doubt_within_the_threshold",
     to_config([](cb_config &config) { config.sensors.threshold_square /= 9; }), "sensors",
     "doubts"},
};

void PrintTo(const wrong_arithmetic &of, std::ostream *out) {
    *out << of.name;
}

class reference_finds : public testing::TestWithParam<wrong_arithmetic> {};

// Not each machine has what the defect changes; the unchanged daemon passes all of these runs.
TEST_P(reference_finds, a_planted_defect) {
    run_options options;
    options.cycles = 1500;
    options.faults = fault_set_of(GetParam().faults);
    int found = 0;
    for (options.seed = 1; options.seed <= 80 && found == 0; ++options.seed) {
        options.prepare = {};
        ASSERT_TRUE(run_isolated(options).violations.empty()) << options.seed;
        options.prepare = [](run &world) {
            plant(world, [&world, planted = GetParam().planted](cb_loop &loop) {
                if (world.starts() >= GetParam().start) planted(loop);
            });
        };
        const run_result result = run_isolated(options);
        found +=
            !result.violations.empty() && result.violations[0].invariant == GetParam().invariant;
    }
    EXPECT_EQ(found, 1);
}

INSTANTIATE_TEST_SUITE_P(world, reference_finds, testing::ValuesIn(arithmetic));

// ---- what files and status say

struct untruth {
    const char *name, *invariant, *faults;
    unsigned seeds;  // one in so many has what the defect needs
    defect planted;
};

defect to_rows(const std::function<void(cb_row &)> &change) {
    return [change](cb_loop &loop) {
        for (cb_row &row : loop.rows) change(row);
    };
}

const untruth untruths[] = {
    {"two_wake_ups_at_once", "statistics", "none", 1,
     to_rows([](cb_row &row) { row.interval_ns = 1; })},
    {"samples_that_were_not_implausible", "statistics", "none", 1,
     [](cb_loop &loop) { loop.box->counters.samples_implausible = 5; }},
    {"frames_that_were_not_lost", "statistics", "none", 1,
     [](cb_loop &loop) { loop.target.can.can.counters.queue_overflows = 5; }},
    {"alarms_that_were_none", "statistics", "none", 1,
     [](cb_loop &loop) { loop.box->counters.nc_alarms = 5; }},
    {"a_lead_that_is_too_long", "statistics", "none", 1,
     [](cb_loop &loop) { loop.box->life.lead.exchange_us = 200000; }},
    {"outputs_that_were_not_sent", "rows", "none", 4,
     to_rows([](cb_row &row) { row.channels[0].output_um = 0.125F; })},
    {"a_reading_that_was_not_read", "rows", "none", 4,
     to_rows([](cb_row &row) { row.signals[3].value += 0.5F; })},
    {"a_lag_of_twice_the_time", "rows", "loss", 4, to_config([](cb_config &config) {
         for (unsigned i = 0; i < config.lags_count; ++i) config.lag_links[i].tau_s *= 2;
     })},
    {"a_hold_that_ends_early", "status", "sensors", 1,
     [](cb_loop &loop) { loop.box->mode.hold_us = 100000000; }},
    {"a_fault_without_missed_periods", "overrun", "none", 1,
     [](cb_loop &loop) {
         if (loop.made > 200) loop.box->life.overrun_score = CB_OVERRUN_FAULT;
     }},
    {"a_fault_without_refused_writes", "refused", "exception", 1,
     [](cb_loop &loop) {
         if (loop.made <= 200) return;
         loop.box->plc.refusing = true;
         loop.box->plc.refused_us = CB_REFUSED_US + 1;
     }},
    {"a_sigma_of_another_place", "sigma", "none", 7,
     [](cb_loop &loop) {
         for (auto &place : loop.box->sigma.place) place[0] = 1e4F;
     }},
    {"measurements_that_count_twice", "adapted", "none", 2,
     [](cb_loop &loop) { loop.box->probes[0].skipped = 10000000; }},
};

void PrintTo(const untruth &of, std::ostream *out) {
    *out << of.name;
}

class untruth_finds : public testing::TestWithParam<untruth> {};

TEST_P(untruth_finds, a_planted_defect) {
    constexpr int tries = 60;
    run_options options;
    options.cycles = 1500;
    options.faults = fault_set_of(GetParam().faults);
    for (int i = 1; i <= tries; ++i) {
        options.seed = GetParam().seeds * static_cast<unsigned>(i);
        options.prepare = [](run &world) { plant(world, GetParam().planted); };
        const run_result result = run_isolated(options);
        if (result.violations.empty() || result.violations[0].invariant != GetParam().invariant)
            continue;
        options.prepare = {};
        EXPECT_TRUE(run_isolated(options).violations.empty()) << options.seed;
        return;
    }
    FAIL() << "none of the runs has what the defect needs";
}

INSTANTIATE_TEST_SUITE_P(world, untruth_finds, testing::ValuesIn(untruths));

TEST(events, a_number_of_lost_ones_that_the_log_does_not_leave_out_is_found) {
    run_options options;
    options.seed = 1;
    options.prepare = [](run &world) {
        world.time.at(20 * second, [&world] {
            const std::string text = world.box.files.text(run::events_path);
            world.box.files.replace(run::events_path, text + "{\"lost_before\": 5}\n");
        });
    };
    const run_result result = run_isolated(options);
    ASSERT_EQ(result.violations.size(), 1u);
    EXPECT_EQ(result.violations[0].invariant, "events");
}

TEST(wrong_files, one_that_runs_is_found) {
    run_options options;
    options.prepare = [](run &world) { world.wrong_revisions.insert(1); };
    const run_result result = run_isolated(options);
    ASSERT_EQ(result.violations.size(), 1u);
    EXPECT_EQ(result.violations[0].invariant, "wrong file");
}

TEST(loading, a_file_that_is_refused_although_it_is_allowed_is_found) {
    run_options options;
    options.prepare = [](run &world) {
        std::string &text = world.box_machine.text;  // of which the rule thinks that it runs
        text.replace(text.find("\"sum\""), 5, "\"sun\"");
    };
    const run_result result = run_isolated(options);
    ASSERT_EQ(result.violations.size(), 1u);
    EXPECT_EQ(result.violations[0].invariant, "loading");
}

TEST(loading, no_box_takes_a_file_with_a_mistake) {
    dice chance(1, "wrong files");
    for (unsigned seed = 1; seed <= 40; ++seed) {
        const std::string good = rare_file(machine_of(seed).text, chance);
        cb_message message = {};
        ASSERT_NE(coefficients::load_coefficient_text(good, &message), nullptr) << message.text;
        for (unsigned i = 0; i < 25; ++i)
            EXPECT_EQ(coefficients::load_coefficient_text(wrong_file(good, chance), &message),
                      nullptr);
    }
}

TEST(rows, those_in_two_files_of_the_black_box_are_found) {
    run_options options;
    options.seed = 1;  // has a black box
    options.prepare = [](run &world) {
        world.time.at(20 * second, [&world] {
            for (const char *name :
                 {"000001-20240101T000000Z-HOLD.csv", "000002-20240101T000100Z-HOLD.csv"})
                world.box.files.put(std::string(run::blackbox_path) + "/" + name,
                                    "time_s,mode,reason,unix_s\n0.000000,1,0,1.000\n");
        });
    };
    const run_result result = run_isolated(options);
    ASSERT_EQ(result.violations.size(), 1u);
    EXPECT_EQ(result.violations[0].invariant, "rows");
}

// ---- a good file that the running daemon refuses

run_options with_quiet_end() {
    run_options options;
    options.seed = 16;  // its box knows no key
    options.cycles = 12000;
    options.faults = {fault_kind::hostile};     // so the recovery is judged …
    options.most = {{fault_kind::hostile, 0}};  // … and the test's own file is the only one
    return options;
}

// The daemon is restarted with another file; the run's good file comes when faults end.
void restart_with(run &world, time_ns at, const std::function<void(json &)> &change) {
    world.time.at(at, [&world, change] {
        json root = json::parse(world.box_machine.text);
        root["revision"] = world.next_revision();
        change(root);
        world.put_signed(root.dump(1));
        world.note_file(root.dump(1));
        world.faults.note(fault_kind::hostile, "another file and a restart");
        world.stop_daemon();
    });
}

void to_another_port(json &root) {
    root["plc"]["transport"]["tcp"]["port"] = 1;
}

void expect_another_restart(const std::function<void(json &)> &change) {
    run_options options = with_quiet_end();
    options.prepare = [&change](run &world) { restart_with(world, 20 * second, change); };
    const run_result result = run_isolated(options);
    ASSERT_TRUE(result.violations.empty()) << result.violations[0].words;
    EXPECT_EQ(result.starts, 3u);
}

TEST(service, a_daemon_that_was_started_with_another_address_is_restarted) {
    expect_another_restart(to_another_port);
}

TEST(service, a_daemon_that_was_started_with_a_later_revision_is_restarted) {
    expect_another_restart([](json &root) { root["revision"] = 1000000; });
}

TEST(service, a_daemon_that_keeps_another_address_is_found) {
    run_options options = with_quiet_end();
    options.prepare = [](run &world) {
        for (time_ns at = 100 * second; at < 400 * second; at += 5 * second)
            restart_with(world, at, to_another_port);
    };
    const run_result result = run_isolated(options);
    ASSERT_EQ(result.violations.size(), 1u);
    EXPECT_EQ(result.violations[0].invariant, "service");
}

}  // namespace
}  // namespace compbox::world
