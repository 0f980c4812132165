// SPDX-License-Identifier: MIT
// The cycle over virtual hardware: order, deadlines, both exchanges, and every fault of fault.h.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/box_fixture.h"
#include "tests/support/virtual_registers.h"

extern "C" {
#include "hal/cycle.h"
#include "tests/support/fault.h"
}

namespace compbox {
namespace {

constexpr int64_t period_us = 30000;
constexpr int64_t forever = std::numeric_limits<int64_t>::max();

config_builder simple(cb_exchange exchange = CB_EXCHANGE_FC3_FC16) {
    config_builder b;
    const unsigned x = b.position("X", 8);
    const unsigned t = b.thermometer("T1");
    b.channel("Z", {b.polyline("EZX", x, {0, 1000}, {0, 100}), b.polynomial("t", t, {0, 1})}, 4);
    b.config->plc.exchange = exchange;
    return b;
}

// A PLC program and a machine: heartbeat every 10 ms, X as commanded, and the slope of what arrives
// in the channel's register is watched.
struct plant {
    virtual_registers sim{period_us, 5000000};
    std::unique_ptr<cb_box> box = std::make_unique<cb_box>();
    std::unique_ptr<cb_faults> faults = std::make_unique<cb_faults>();
    std::vector<cb_fault_rule> rules;
    cb_cycle cycle{};
    cb_hal hal{};
    double x_mm = 400;
    uint16_t control = 1 | 2 | 8;
    bool dead = false;  // the PLC's program stands still
    std::string order;  // of what the PLC saw: u(pdate), w(ritten)
    double held_um = 0, held_s = 0, steepest = 0;

    explicit plant(const config_builder &b = simple()) {
        std::memset(box.get(), 0, sizeof *box);
        box->config = *b.config;
        cb_box_start(box.get());
        cb_cycle_start(&cycle);
        sim.update = [this](int64_t now_us) { update(now_us); };
        sim.written = [this](int64_t now_us) { written(now_us); };
        sim.wire = {2000, 2000};
        hal = sim.hal();
    }
    void inject(cb_fault_kind kind, int64_t from_us, int64_t until_us, int64_t number = 0,
                uint32_t every = 1) {
        rules.push_back({kind, from_us, until_us, every, number, 0});
        std::memset(faults.get(), 0, sizeof *faults);
        faults->inner = sim.hal();
        faults->rules = rules.data();
        faults->count = rules.size();
        faults->pass = [](void *inner, int64_t until) {
            static_cast<simulation::virtual_hal *>(inner)->pass(until);
        };
        hal = cb_faults_hal(faults.get());
    }
    void unplug() { inject(CB_FAULT_DROP, 0, forever); }
    void plug() {
        rules.clear();
        hal = sim.hal();
    }

    void update(int64_t now_us) {
        order += 'u';
        sim.registers()[0] = control;
        if (!dead) sim.registers()[1] = static_cast<uint16_t>(now_us / 10000);
        put_int32(sim.registers() + 8, x_mm / 0.0001);
    }
    void written(int64_t now_us) {
        order += 'w';
        const double um = get_int32(sim.registers() + 104) * 0.01,
                     s = static_cast<double>(now_us) * 1e-6;
        // From the one written before, at the time it was written; 2 ms of jitter in the exchange.
        const double most = 500 * std::min(s - held_s + 0.002, 0.060);
        steepest = std::max(steepest, std::fabs(um - held_um) / most);
        held_um = um;
        held_s = s;
    }

    void run(unsigned cycles) {
        for (unsigned i = 0; i < cycles; ++i) cb_cycle_run(&cycle, box.get(), &hal);
    }
    cb_mode mode() const { return static_cast<cb_mode>(box->mode.mode); }
    double held() const { return held_um; }
    int64_t after(int64_t us) const { return sim.now_us() + us; }
};

// ---- a client beside the loop (hal.h, handed)

struct beside {
    static inline plant *of = nullptr;
    static inline cb_transfer fate = CB_TRANSFER_OK;
    static constexpr int64_t read_before_us = 4000, written_before_us = 1000;

    static cb_handed handed(void *) {
        const int64_t now_us = of->sim.now_us();
        return {now_us - read_before_us, static_cast<uint8_t>(fate), now_us - written_before_us};
    }
    static void on(plant &p) {
        of = &p;
        fate = CB_TRANSFER_OK;
        p.sim.wire = {0, 0};
        p.hal = p.sim.hal();
        p.hal.write_read = nullptr;  // never called
        p.hal.handed = handed;
    }
};

TEST(cycle, a_client_beside_the_loop_gives_the_time_of_the_reading_and_the_fate_of_the_write) {
    for (cb_exchange exchange : {CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23}) {
        plant p(simple(exchange));
        beside::on(p);
        p.run(20);
        ASSERT_EQ(p.mode(), CB_MODE_ACTIVE);
        EXPECT_EQ(p.cycle.tick_us - p.cycle.in.read_us, beside::read_before_us);
        EXPECT_EQ(p.cycle.in.exchange_us, static_cast<uint32_t>(period_us + beside::read_before_us -
                                                                beside::written_before_us));
        EXPECT_EQ(p.cycle.write, CB_TRANSFER_OK);
        EXPECT_GT(p.sim.writes, 10u);
        beside::fate = CB_TRANSFER_REFUSED;
        const uint32_t refused = p.box->counters.writes_refused;
        p.run(2);
        EXPECT_EQ(p.box->counters.writes_refused, refused + 2);
        EXPECT_EQ(p.cycle.step_last_write, CB_TRANSFER_REFUSED);
    }
}

TEST(cycle, a_last_write_of_a_client_beside_the_loop_is_left_behind_when_its_fate_is_unknown) {
    static int left;
    plant p;
    beside::on(p);
    left = 0;
    p.hal.leave = [](void *) { ++left; };
    p.run(20);
    beside::fate = CB_TRANSFER_UNKNOWN;
    bool last = false;
    for (int i = 0; i < 20 && !last; ++i) {
        p.run(1);
        last = p.cycle.out.last;
    }
    ASSERT_TRUE(last);
    EXPECT_EQ(left, 0) << "its result comes with the next cycle";
    p.run(1);
    EXPECT_EQ(left, 1);
}

// ---- a configuration that has changed in memory

// Its addresses, lengths and times are not used for another exchange, with either request.
TEST(cycle, a_corrupt_configuration_ends_the_exchange) {
    for (cb_exchange exchange : {CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23}) {
        for (int what = 0; what < 4; ++what) {
            plant p(simple(exchange));
            p.run(20);
            ASSERT_EQ(p.mode(), CB_MODE_ACTIVE);
            const uint32_t reads = p.sim.reads, writes = p.sim.writes;
            cb_config &c = p.box->config;
            if (what == 0) c.plc.write.start ^= 0x8000;
            if (what == 1) c.plc.read.count ^= 0x4000;
            if (what == 2) c.period_us ^= 0x80000000u;
            if (what == 3) c.plc.exchange ^= 1;
            p.run(20);
            EXPECT_EQ(p.sim.reads, reads);
            EXPECT_EQ(p.sim.writes, writes);
            EXPECT_EQ(p.box->mode.reason, CB_REASON_CONFIG_CORRUPT);
            EXPECT_EQ(p.sim.watchdog_fed, 40u);
        }
    }
}

// ---- the exchange

TEST(cycle, reads_steps_and_writes_in_one_period) {
    plant p;
    p.sim.registers()[99] = p.sim.registers()[115] = p.sim.registers()[116] = 7;
    p.run(1);
    EXPECT_EQ(p.order, "uuuuuuwu");  // tick; middle and end of reading, read-back and write
    EXPECT_EQ(p.cycle.tick_us, 5000000 + period_us);
    EXPECT_EQ(p.cycle.exchange_us, 6000);
    EXPECT_EQ(p.cycle.in.read_us, p.cycle.tick_us);
    EXPECT_EQ(p.cycle.read, CB_TRANSFER_OK);
    EXPECT_EQ(p.cycle.write, CB_TRANSFER_OK);
    EXPECT_EQ(p.sim.watchdog_fed, 1u);
    EXPECT_EQ(p.sim.registers()[101], 1);
    EXPECT_EQ(p.sim.registers()[99], 7);
    EXPECT_EQ(p.sim.registers()[115], 0);  // the whole write block
    EXPECT_EQ(p.sim.registers()[116], 7);
    p.run(99);
    EXPECT_EQ(p.cycle.tick_us, 5000000 + 100 * period_us);  // no drift
    EXPECT_EQ(p.mode(), CB_MODE_ACTIVE);
    EXPECT_DOUBLE_EQ(p.held(), -40);
    EXPECT_EQ(p.sim.reads, 100u + 3u);  // read back at the first contact, and once a second
    EXPECT_EQ(p.sim.writes, 100u);
}

// Where two requests take more than half of the time a third one would cost the write.
TEST(cycle, is_not_read_back_where_the_exchange_leaves_no_room) {
    plant p;
    p.sim.wire = {7000, 7000};  // 14 of 24 ms
    p.run(200);
    EXPECT_EQ(p.mode(), CB_MODE_ACTIVE);
    EXPECT_EQ(p.sim.reads, 200u + 1u);
    EXPECT_EQ(p.box->counters.writes_failed, 0u);
}

TEST(cycle, fc23_writes_the_outputs_of_the_cycle_before) {
    plant p(simple(CB_EXCHANGE_FC23));
    p.run(1);
    EXPECT_EQ(p.sim.writes, 0u);  // it has to hear the PLC before it writes
    EXPECT_EQ(p.sim.reads, 2u);   // of both blocks
    EXPECT_TRUE(p.cycle.out.write);
    p.run(1);
    EXPECT_EQ(p.sim.writes, 1u);
    EXPECT_EQ(p.sim.registers()[101], 1);
    EXPECT_EQ(p.cycle.out.registers[1], 2);
    EXPECT_EQ(p.cycle.exchange_us, 2000);
    p.run(20);
    EXPECT_DOUBLE_EQ(p.held(), -40);
    EXPECT_EQ(p.box->counters.writes_failed, 0u);
    EXPECT_EQ(p.sim.reads, 23u);
}

// A PLC whose replies take most of the time: one request fits into a cycle, two do not.
TEST(cycle, fc23_finds_a_plc_whose_reply_takes_most_of_the_time) {
    for (const bool starts_slow : {true, false}) {
        plant p(simple(CB_EXCHANGE_FC23));
        if (!starts_slow) {
            p.run(20);
            p.unplug();
            p.run(20);
            p.plug();
        }
        p.sim.wire = {20000, 20000};  // of 24 ms
        p.run(4);
        EXPECT_EQ(p.box->plc.contact, CB_CONTACT_KNOWN);
        p.run(20);
        EXPECT_EQ(p.mode(), CB_MODE_ACTIVE);
        EXPECT_DOUBLE_EQ(p.held(), -40);
        EXPECT_LE(p.steepest, 1);
        EXPECT_EQ(p.sim.registers()[100] & 0xFF, CB_MODE_ACTIVE);
    }
}

// A read-back of its own cycle that has no reply is asked for again, behind another reading.
TEST(cycle, a_read_back_of_its_own_cycle_that_fails_is_repeated) {
    plant p(simple(CB_EXCHANGE_FC23));
    p.sim.wire = {20000, 20000};
    p.run(1);  // the reading
    ASSERT_EQ(p.sim.reads, 1u);
    p.unplug();
    p.run(1);
    EXPECT_EQ(p.cycle.in.held, CB_TRANSFER_FAILED);
    p.plug();
    p.run(1);
    EXPECT_TRUE(p.cycle.in.read_ok);
    EXPECT_EQ(p.box->plc.contact, CB_CONTACT_NONE);
    p.run(1);
    EXPECT_FALSE(p.cycle.in.read_ok);
    EXPECT_EQ(p.cycle.in.held, CB_TRANSFER_OK);
    EXPECT_EQ(p.box->plc.contact, CB_CONTACT_NONE) << "a read-back needs a reading beside it";
    p.run(1);
    EXPECT_EQ(p.box->plc.contact, CB_CONTACT_KNOWN);
}

// The PLC may have restarted in a pause behind the read-back, so that is made again.
TEST(cycle, a_read_back_of_its_own_cycle_is_not_used_behind_a_pause) {
    plant p(simple(CB_EXCHANGE_FC23));
    p.sim.wire = {20000, 20000};
    p.run(2);
    ASSERT_EQ(p.cycle.in.held, CB_TRANSFER_OK);
    p.sim.pass(p.after(3 * period_us));
    p.run(1);
    EXPECT_TRUE(p.cycle.in.read_ok);
    EXPECT_EQ(p.box->plc.contact, CB_CONTACT_NONE);
    p.run(2);
    EXPECT_EQ(p.box->plc.contact, CB_CONTACT_KNOWN);
}

TEST(cycle, without_a_plc_nothing_is_written_and_the_watchdog_is_fed) {
    for (cb_exchange exchange : {CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23}) {
        plant p(simple(exchange));
        p.unplug();
        p.run(50);
        EXPECT_EQ(p.sim.watchdog_fed, 50u);
        EXPECT_EQ(p.box->counters.reads_failed, 50u);
        EXPECT_EQ(p.box->counters.writes_failed, 0u);
        p.plug();
        p.run(10);
        EXPECT_EQ(p.mode(), CB_MODE_ACTIVE);
        EXPECT_DOUBLE_EQ(p.held(), -40);
        EXPECT_LE(p.steepest, 1);
    }
}

TEST(cycle, no_request_is_begun_that_cannot_end_in_time) {
    plant p;
    p.sim.wire = {13000, 13000};  // two of them are more than 24 ms
    p.run(10);
    EXPECT_EQ(p.cycle.read, CB_TRANSFER_OK);
    EXPECT_EQ(p.cycle.write, CB_TRANSFER_FAILED);
    EXPECT_EQ(p.sim.writes, 0u);
    EXPECT_LE(p.cycle.exchange_us, 24000);
    EXPECT_EQ(p.box->counters.missed_ticks, 0u);
}

TEST(cycle, nothing_is_written_after_the_deadline) {
    plant p;
    p.run(20);
    p.sim.wire = {0, 0};  // so that the hardware would let it through
    p.inject(CB_FAULT_LATE, p.sim.now_us(), forever);
    const uint32_t before = p.sim.writes;
    p.run(3);
    EXPECT_EQ(p.sim.writes, before);
    EXPECT_EQ(p.box->counters.writes_failed, 2u);  // and the third is not known yet
}

TEST(cycle, when_the_read_fails_the_held_output_is_written) {
    plant p;
    p.run(20);
    p.inject(CB_FAULT_REFUSE_READ, p.sim.now_us(), forever);
    const uint32_t before = p.sim.writes;
    p.run(10);
    EXPECT_EQ(p.sim.writes, before + 10);
    EXPECT_EQ(p.mode(), CB_MODE_HOLD);
    EXPECT_EQ(p.sim.registers()[100] & 0xFF, CB_MODE_HOLD);
    EXPECT_DOUBLE_EQ(p.held(), -40);
    p.run(60);
    EXPECT_EQ(p.mode(), CB_MODE_STANDBY);
    EXPECT_EQ(p.held(), 0);
    EXPECT_EQ(p.sim.registers()[101], 90);
}

TEST(cycle, missed_ticks_are_skipped_and_counted) {
    plant p;
    p.run(20);
    p.sim.pass(p.after(70000));  // the program was kept from running
    p.run(1);
    EXPECT_EQ(p.cycle.in.missed_ticks, 2u);
    EXPECT_EQ((p.cycle.tick_us - 5000000) % period_us, 0);
    p.run(1);
    EXPECT_EQ(p.cycle.in.missed_ticks, 0u);
    EXPECT_EQ(p.box->counters.missed_ticks, 2u);
    EXPECT_EQ(p.mode(), CB_MODE_ACTIVE);
}

TEST(cycle, fc23_after_a_suspend_writes_nothing_from_before_it) {
    plant p(simple(CB_EXCHANGE_FC23));
    p.run(20);
    EXPECT_EQ(p.mode(), CB_MODE_ACTIVE);
    std::vector<unsigned> modes;  // that the PLC gets
    p.sim.written = [&](int64_t now_us) {
        modes.push_back(p.sim.registers()[100] & 0xFFu);
        p.written(now_us);
    };
    p.control = 2;  // meanwhile enable goes away
    p.sim.pass(p.after(60 * 1000000));
    p.run(1);
    EXPECT_TRUE(modes.empty());
    EXPECT_EQ(p.box->counters.writes_failed, 1u);
    p.run(10);
    ASSERT_FALSE(modes.empty());
    EXPECT_EQ(std::count(modes.begin(), modes.end(), CB_MODE_ACTIVE), 0);
    EXPECT_LE(p.steepest, 1);
}

TEST(cycle, what_was_read_before_a_suspend_is_not_given_to_the_step_behind_it) {
    plant p;
    p.run(40);
    p.unplug();
    p.run(8);  // contact is lost, so the block is read back once the PLC is there
    p.plug();
    const auto awake = p.hal.stop_requested;
    p.hal.stop_requested = [](void *context) {
        auto *sim = static_cast<simulation::virtual_hal *>(context);
        sim->pass(sim->now_us() + 60 * 1000000);
        return false;
    };
    p.run(1);
    EXPECT_EQ(p.cycle.read, CB_TRANSFER_OK);
    EXPECT_FALSE(p.cycle.in.read_ok);
    EXPECT_EQ(p.cycle.in.held, CB_TRANSFER_NONE);
    EXPECT_FALSE(p.cycle.out.write);
    p.hal.stop_requested = awake;
    p.run(1);
    EXPECT_TRUE(p.cycle.in.read_ok);
    EXPECT_LE(p.steepest, 1);
}

// Not even where the pause is short enough for the reading to count: the contact that is lost by it
// needs a read-back of its own.
TEST(cycle, what_was_read_back_before_a_pause_does_not_place_the_outputs_behind_it) {
    plant p;
    p.run(40);
    p.unplug();
    p.run(8);
    p.plug();
    const auto awake = p.hal.stop_requested;
    p.hal.stop_requested = [](void *context) {
        auto *sim = static_cast<simulation::virtual_hal *>(context);
        sim->pass(sim->now_us() + 3 * period_us);
        return false;
    };
    p.run(1);
    EXPECT_TRUE(p.cycle.in.read_ok);
    EXPECT_EQ(p.cycle.in.held, CB_TRANSFER_NONE);
    EXPECT_EQ(p.box->plc.contact, CB_CONTACT_LOST);
    EXPECT_FALSE(p.cycle.out.write);
    p.hal.stop_requested = awake;
    p.run(1);
    EXPECT_EQ(p.box->plc.contact, CB_CONTACT_KNOWN);
    EXPECT_LE(p.steepest, 1);
}

TEST(cycle, samples_reach_the_box) {
    plant p;
    p.run(20);
    p.sim.samples.push_back({1, 50, p.sim.now_us()});
    p.run(5);
    EXPECT_DOUBLE_EQ(p.held(), -45);
    p.sim.samples.assign(CB_MAX_SAMPLES + 10, {1, 60, p.sim.now_us()});
    p.run(1);
    EXPECT_EQ(p.cycle.in.sample_count, CB_MAX_SAMPLES);
    EXPECT_EQ(p.sim.samples.size(), 10u);
}

TEST(cycle, a_stop_ends_with_zero_and_status_stopped_at_the_plc) {
    for (cb_exchange exchange : {CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23}) {
        plant p(simple(exchange));
        p.run(20);
        p.sim.stop = true;
        int cycles = 0;
        while (!p.cycle.out.stopped && cycles < 1000) {
            p.run(1);
            ++cycles;
        }
        EXPECT_LE(cycles * 0.030, 40.0 / 50 + 1);
        EXPECT_EQ(p.held(), 0);
        EXPECT_EQ(p.sim.registers()[100], CB_REASON_STOP << 8 | CB_MODE_STOPPED);
    }
}

// ---- losing and finding the PLC

TEST(cycle, a_plc_that_restarts_is_met_where_it_is) {
    for (cb_exchange exchange : {CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23}) {
        plant p(simple(exchange));
        p.run(20);
        p.unplug();
        p.run(8);
        EXPECT_EQ(p.mode(), CB_MODE_HOLD);
        put_int32(p.sim.registers() + 104, 0);  // its setting data are zeroed at start
        p.held_um = 0;
        p.plug();
        p.run(20);
        EXPECT_EQ(p.mode(), CB_MODE_ACTIVE);  // permit resume is on
        EXPECT_DOUBLE_EQ(p.held(), -40);
        EXPECT_LE(p.steepest, 1);
        EXPECT_EQ(p.box->counters.resyncs, 1u);
    }
}

TEST(cycle, after_an_outage_the_outputs_go_on_from_what_the_plc_holds) {
    plant p;
    p.run(20);
    p.unplug();
    p.run(200);
    EXPECT_EQ(p.mode(), CB_MODE_STANDBY);  // the box has ramped down for itself …
    EXPECT_EQ(p.cycle.out.channel_um[0], 0);
    EXPECT_EQ(p.cycle.in.last_write, CB_TRANSFER_NONE);
    p.control = 2;
    p.plug();
    p.run(1);
    EXPECT_DOUBLE_EQ(p.held(), -40);  // … but the PLC had not
    EXPECT_EQ(p.mode(), CB_MODE_RAMP);
    p.run(30);
    EXPECT_EQ(p.held(), 0);
    EXPECT_LE(p.steepest, 1);
}

// Behind a last write without an answer the connection is left; it is the only one of its kind.
TEST(cycle, the_connection_is_left_behind_a_last_write) {
    static unsigned left;
    static uint32_t writes;
    static const plant *at;
    left = 0;
    plant p;
    at = &p;
    p.run(20);
    p.inject(CB_FAULT_WRITE_TOOK, p.sim.now_us(), forever);
    p.hal.leave = [](void *) {
        ++left;
        writes = at->sim.writes;
    };
    for (int i = 0; i < 100 && left == 0; ++i) p.run(1);
    EXPECT_EQ(left, 1u);
    EXPECT_TRUE(p.cycle.out.last);
    EXPECT_EQ(writes, p.sim.writes);
    EXPECT_EQ(p.sim.registers()[100], CB_MODE_HOLD | CB_REASON_UNCONFIRMED << 8);
    EXPECT_DOUBLE_EQ(p.held(), -40);
    p.run(1);
    EXPECT_FALSE(p.cycle.out.last);
    p.run(100);
    EXPECT_EQ(left, 1u) << "the status that follows is true without it";
    EXPECT_LE(p.steepest, 1);
}

// ---- faults

// Cycles of the fault and after it, from a running box; what the box makes of it.
struct fault_case {
    cb_fault_kind kind;
    int64_t number;
    uint32_t every;
    cb_mode mode_in_fault;  // after a second of it
    bool counted;           // some counter of errors moved
};

const fault_case cases[] = {
    {CB_FAULT_DROP, 0, 1, CB_MODE_RAMP, true},
    {CB_FAULT_DROP, 0, 3, CB_MODE_ACTIVE, true},
    {CB_FAULT_LATE, 0, 1, CB_MODE_RAMP, true},
    {CB_FAULT_LATE, 0, 2, CB_MODE_ACTIVE, true},
    {CB_FAULT_REFUSE_READ, 0, 1, CB_MODE_RAMP, true},
    {CB_FAULT_REFUSE_WRITE, 0, 1, CB_MODE_RAMP, true},
    {CB_FAULT_REFUSE_WRITE, 0, 2, CB_MODE_ACTIVE, true},
    {CB_FAULT_WRITE_TOOK, 0, 1, CB_MODE_RAMP, true},
    {CB_FAULT_WRITE_TOOK, 0, 2, CB_MODE_ACTIVE, true},
    {CB_FAULT_WRITE_LOST, 0, 1, CB_MODE_RAMP, true},
    {CB_FAULT_WRITE_LOST, 0, 2, CB_MODE_ACTIVE, true},
    {CB_FAULT_FREEZE, 1, 1, CB_MODE_RAMP, true},
    {CB_FAULT_MISS_TICKS, 1, 4, CB_MODE_ACTIVE, true},
    {CB_FAULT_CLOCK, 40000, 1, CB_MODE_ACTIVE, false},
    {CB_FAULT_CLOCK, -500, 1, CB_MODE_ACTIVE, false},
    {CB_FAULT_CLOCK, 1000000, 1, CB_MODE_ACTIVE, true},
    {CB_FAULT_CLOCK, -1000000, 1, CB_MODE_ACTIVE, true},
};

uint32_t errors(const cb_counters &c) {
    return c.reads_failed + c.writes_failed + c.writes_refused + c.writes_unknown +
           c.heartbeats_lost + c.clock_jumps + c.missed_ticks;
}

void survive(const fault_case &fault, cb_exchange exchange) {
    SCOPED_TRACE(testing::Message() << "kind " << fault.kind << " number " << fault.number
                                    << " every " << fault.every << " exchange " << exchange);
    plant p(simple(exchange));
    p.run(20);
    ASSERT_EQ(p.mode(), CB_MODE_ACTIVE);
    p.inject(fault.kind, p.sim.now_us(), p.after(1200000), fault.number, fault.every);
    for (int i = 0; i < 34; ++i) {
        p.x_mm = 400 + 10 * (i % 7);
        const int64_t before_us = p.sim.now_us();
        p.run(1);
        EXPECT_LE(p.sim.now_us() - before_us, 5 * period_us);
    }
    EXPECT_EQ(p.mode(), fault.mode_in_fault) << cb_mode_name(p.box->mode.mode);
    EXPECT_EQ(errors(p.box->counters) > 0, fault.counted);
    EXPECT_GT(p.faults->injected + (fault.kind == CB_FAULT_CLOCK), 0u);
    p.x_mm = 500;
    p.run(60);
    EXPECT_EQ(p.mode(), CB_MODE_ACTIVE);  // recovers by itself: permit resume is on
    EXPECT_DOUBLE_EQ(p.held(), -50);
    EXPECT_LE(p.steepest, 1.0);
    EXPECT_EQ(p.box->counters.faults, 0u);
}

TEST(cycle, every_fault_is_survived_and_the_box_comes_back) {
    for (const fault_case &fault : cases)
        for (cb_exchange exchange : {CB_EXCHANGE_FC3_FC16, CB_EXCHANGE_FC23})
            survive(fault, exchange);
}

TEST(cycle, torn_readings_are_seen_by_their_counters) {
    config_builder b = simple();
    b.config->plc.read.counters = true;
    b.config->plc.control = 2;
    b.config->plc.plc_heartbeat = 1;
    plant p(b);
    p.sim.update = [&p](int64_t now_us) {
        p.update(now_us);
        uint16_t *registers = p.sim.registers();
        registers[2] = p.control;
        registers[0] = registers[31] = static_cast<uint16_t>(now_us / 1000);
    };
    p.run(20);
    ASSERT_EQ(p.mode(), CB_MODE_ACTIVE);
    p.inject(CB_FAULT_TORN, p.sim.now_us(), p.after(300000), 0, 2);
    p.run(30);
    EXPECT_EQ(p.box->counters.reads_torn, 4u);  // the first of the window has no reading before it
    EXPECT_EQ(p.mode(), CB_MODE_ACTIVE);
}

TEST(cycle, a_fault_outside_its_window_changes_nothing) {
    plant with, without;
    with.inject(CB_FAULT_DROP, 0, 100);
    for (int i = 0; i < 100; ++i) {
        with.x_mm = without.x_mm = 400 + i;
        with.run(1);
        without.run(1);
        ASSERT_EQ(std::memcmp(with.cycle.out.registers, without.cycle.out.registers,
                              sizeof with.cycle.out.registers),
                  0);
    }
    EXPECT_EQ(with.faults->injected, 0u);
}

TEST(cycle, refused_writes_end_in_the_fault_and_reset_clears_it) {
    plant p;
    p.run(20);
    p.inject(CB_FAULT_REFUSE_WRITE, p.sim.now_us(), p.after(4000000));
    p.run(130);
    EXPECT_EQ(p.mode(), CB_MODE_FAULT);
    EXPECT_EQ(p.box->mode.reason, CB_REASON_WRITE_REFUSED);
    p.run(50);
    EXPECT_EQ(p.mode(), CB_MODE_FAULT);
    p.control |= 4;
    p.run(20);
    EXPECT_EQ(p.mode(), CB_MODE_ACTIVE);  // permit resume is on
    EXPECT_LE(p.steepest, 1);
}

}  // namespace
}  // namespace compbox
