// SPDX-License-Identifier: MIT
// The twin's heat and force against closed solutions, its thermometers, and what the PLC shows.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "host-tools/fakeplc/plc.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/twin/machine.h"
#include "host-tools/twin/process.h"
#include "tests/support/paths.h"
#include "tests/support/temporary.h"

namespace compbox::twin {
namespace {

const std::string thermal_example = from_source("examples/bpnet-840d/machine_twin.json");

// 10 kJ/K against 5 W/K: 2000 s; 100 W at 3000 1/min, by the square.
thermal_config one_node() {
    thermal_config config;
    config.nodes = {{"spindle", 10.0, 5.0}};
    config.heats = {{0, heat_drive::spindle_rpm, 100.0, 3000.0, 2.0}};
    config.sensors = {{"T", 0, 0.0, 0.0, 0.0, 0.0}};
    return config;
}

thermal_load at_rpm(double rpm) {
    thermal_load load;
    load.spindle_rpm = rpm;
    return load;
}

void run(thermal_process &process, double time_s, double dt_s, const thermal_load &load) {
    const long steps = std::lround(time_s / dt_s);
    for (long i = 0; i < steps; ++i) process.advance(dt_s, load);
}

TEST(Thermal, ALumpWarmsByItsTimeConstant) {
    thermal_process process(one_node(), 1);
    for (const double time_s : {500.0, 2000.0, 8000.0}) {
        thermal_process fresh(one_node(), 1);
        run(fresh, time_s, 1.0, at_rpm(3000.0));
        EXPECT_NEAR(fresh.node_degC()[0], 20.0 + 20.0 * (1.0 - std::exp(-time_s / 2000.0)), 0.01);
    }
    run(process, 20000.0, 1.0, at_rpm(6000.0));  // twice the speed: four times the heat
    EXPECT_NEAR(process.node_degC()[0], 20.0 + 80.0, 0.02);
    run(process, 2000.0, 1.0, at_rpm(0.0));
    EXPECT_NEAR(process.node_degC()[0], 20.0 + 80.0 * std::exp(-1.0), 0.05);
}

TEST(Thermal, HowTheTimeIsDividedDoesNotMatter) {
    thermal_process fine(one_node(), 1), coarse(one_node(), 1);
    run(fine, 600.0, 0.004, at_rpm(4000.0));
    run(coarse, 600.0, 0.25, at_rpm(4000.0));
    EXPECT_NEAR(fine.node_degC()[0], coarse.node_degC()[0], 1e-6);
}

TEST(Thermal, CoupledLumpsShareTheirHeat) {
    thermal_config config = one_node();
    config.nodes.push_back({"column", 100.0, 0.0});  // cooled by the spindle alone
    config.couplings = {{0, 1, 3.0}};
    thermal_process process(config, 1);
    run(process, 400000.0, 1.0, at_rpm(3000.0));
    EXPECT_NEAR(process.node_degC()[0], 40.0, 0.02);  // 100 W by 5 W/K
    EXPECT_NEAR(process.node_degC()[1], 40.0, 0.02);  // nothing flows any more
}

TEST(Thermal, AFastLumpIsFollowedStably) {
    thermal_config config = one_node();
    config.nodes[0].capacity_kJ_per_K = 0.002;  // 0.4 s
    thermal_process process(config, 1);
    run(process, 10.0, 1.0, at_rpm(3000.0));
    EXPECT_NEAR(process.node_degC()[0], 40.0, 0.1);
}

TEST(Thermal, AirSwingsOverTheDay) {
    thermal_config config = one_node();
    config.air = {20.0, 3.0, 15.0, 15.0};
    thermal_process process(config, 1);
    EXPECT_NEAR(process.air_degC(), 23.0, 1e-9);
    run(process, 12.0 * 3600.0, 1.0, {});
    EXPECT_NEAR(process.air_degC(), 17.0, 1e-9);
    // First order behind the air: amplitude and phase of a lag of 2000 s.
    run(process, 36.0 * 3600.0, 1.0, {});
    const double w = 2.0 * M_PI / 86400.0;
    const double expected =
        20.0 + 3.0 * std::cos(std::atan(w * 2000.0)) / std::hypot(1.0, w * 2000.0);
    EXPECT_NEAR(process.node_degC()[0], expected, 0.01);
}

TEST(Thermal, ThermometersLagRoundAndTremble) {
    thermal_config config = one_node();
    config.nodes[0].capacity_kJ_per_K = 1e4;  // stands still
    config.sensors = {{"T", 0, 0.0, 0.1, 0.0, 0.0}, {"N", 0, 0.0, 0.0, 0.05, 0.0}};
    config.air.mean_degC = 20.04;
    thermal_process process(config, 7);
    double sum = 0.0, squares = 0.0;
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i) {
        process.advance(1.0, {});
        EXPECT_NEAR(process.sensor_degC()[0], 20.0, 1e-9);
        const double off = process.sensor_degC()[1] - 20.04;
        sum += off, squares += off * off;
    }
    EXPECT_NEAR(sum / n, 0.0, 0.002);
    EXPECT_NEAR(std::sqrt(squares / n), 0.05, 0.002);
    // A sensor's lag, on a node that jumps.
    config = one_node();
    config.nodes[0].capacity_kJ_per_K = 0.01;
    config.sensors[0].lag_s = 30.0;
    thermal_process jumps(config, 7);
    run(jumps, 10.0, 1.0, at_rpm(3000.0));
    const double before = jumps.sensor_degC()[0];
    run(jumps, 30.0, 1.0, at_rpm(3000.0));
    EXPECT_NEAR(40.0 - jumps.sensor_degC()[0], (40.0 - before) * std::exp(-1.0), 0.1);
}

TEST(Thermal, ExpansionHasAPartThatDependsOnPosition) {
    thermal_config config = one_node();
    config.expansions = {{0, 2, -3.0, 0.0, 0, 0.0}, {0, 0, 0.5, 11.0, 0, 100.0}};
    const auto error = thermal_error_um(config, {25.0}, {600.0, 0.0, 0.0});
    EXPECT_DOUBLE_EQ(error[0], 5.0 * (0.5 + 11.0 * 0.5));
    EXPECT_DOUBLE_EQ(error[1], 0.0);
    EXPECT_DOUBLE_EQ(error[2], -15.0);
}

TEST(Thermal, ASeedIsAnotherMachineWithinItsSpread) {
    const thermal_config kind = load_twin(thermal_example).thermal;
    double least = 2.0, most = 0.0;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const thermal_config one = drawn(kind, seed);
        for (std::size_t n = 0; n < kind.nodes.size(); ++n) {
            const double part = one.nodes[n].capacity_kJ_per_K / kind.nodes[n].capacity_kJ_per_K;
            least = std::min(least, part), most = std::max(most, part);
        }
        for (std::size_t s = 0; s < kind.sensors.size(); ++s) {
            EXPECT_LE(std::fabs(one.sensors[s].offset_K), kind.sensors[s].offset_K);
        }
    }
    EXPECT_GE(least, 1.0 - kind.spread);
    EXPECT_LE(most, 1.0 + kind.spread);
    EXPECT_LT(least, 1.0 - 0.95 * kind.spread);
    EXPECT_GT(most, 1.0 + 0.95 * kind.spread);
    EXPECT_EQ(drawn(kind, 5).heats[0].watt, drawn(kind, 5).heats[0].watt);
}

// The network's rates of decay, 1/s, ascending: eigenvalues of its conductances over its
// capacities.
Eigen::VectorXd rates_of(const thermal_config &config) {
    const auto size = static_cast<Eigen::Index>(config.nodes.size());
    Eigen::MatrixXd W_per_K = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd scale(size);
    for (Eigen::Index n = 0; n < size; ++n) {
        const thermal_node &node = config.nodes[static_cast<std::size_t>(n)];
        W_per_K(n, n) = node.to_air_W_per_K;
        scale[n] = 1.0 / std::sqrt(1000.0 * node.capacity_kJ_per_K);
    }
    for (const auto &coupling : config.couplings) {
        const auto one = static_cast<Eigen::Index>(coupling.one);
        const auto other = static_cast<Eigen::Index>(coupling.other);
        W_per_K(one, one) += coupling.W_per_K, W_per_K(other, other) += coupling.W_per_K;
        W_per_K(one, other) -= coupling.W_per_K, W_per_K(other, one) -= coupling.W_per_K;
    }
    const Eigen::MatrixXd rates = scale.asDiagonal() * W_per_K * scale.asDiagonal();
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(rates, Eigen::EigenvaluesOnly)
        .eigenvalues();
}

TEST(Thermal, TimeConstantsReachFromMinutesToTwoHours) {
    EXPECT_NEAR(1.0 / rates_of(one_node())[0], 2000.0, 1.0);
    const thermal_config kind = load_twin(thermal_example).thermal;
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
        const Eigen::VectorXd rates = rates_of(drawn(kind, seed));
        const double longest_s = 1.0 / rates.minCoeff(), shortest_s = 1.0 / rates.maxCoeff();
        EXPECT_GT(shortest_s, 120.0);
        EXPECT_LT(shortest_s, 900.0);
        EXPECT_GT(longest_s, 3600.0);
        EXPECT_LT(longest_s, 9000.0);
    }
}

// ---- force

cutting_config milling() {
    cutting_config config;
    config.N_per_mm = 1000.0, config.exponent = 1.0, config.teeth = 2;
    config.share = {0.0, -1.0, 0.0};
    config.stiffness_N_per_um = {10.0, 20.0, 40.0};
    config.tool_diameter_mm = 10.0, config.rated_Nm = 5.0;
    config.idle_percent = 8.0, config.full_rpm = 8000.0;
    config.walls = {{"wall", 1, 0, {100.0, 300.0}, {190.0, 210.0}, {0.0, 40.0}, 0.5, 0.4}};
    return config;
}

// 3000 1/min, 240 mm/min, two teeth: 0.04 mm a tooth.
const cut milling_cut = {3000.0, 4.0, 1.5};

TEST(Force, GrowsWithDepthAndFeedPerTooth) {
    const cutting_config config = milling();
    EXPECT_NEAR(force_N(config, milling_cut), 1000.0 * 1.5 * 0.04, 1e-9);
    EXPECT_EQ(force_N(config, {3000.0, 4.0, 0.0}), 0.0);
    EXPECT_EQ(force_N(config, {3000.0, 0.0, 1.5}), 0.0);
    EXPECT_EQ(force_N(config, {0.0, 4.0, 1.5}), 0.0);
    EXPECT_NEAR(spindle_load_percent(config, milling_cut), 3.0 + 100.0 * 60.0 * 0.005 / 5.0, 1e-9);
    EXPECT_NEAR(cutting_power_W(config, milling_cut), 60.0 * M_PI * 0.01 * 50.0, 1e-9);
}

TEST(Force, TheWallYieldsMostAtTheTopOfItsEnds) {
    const cutting_config config = milling();
    const auto y = [&](double x, double across, double z) {
        return force_error_um(config, milling_cut, {x, across, z})[1];
    };
    EXPECT_NEAR(y(500.0, 200.0, 40.0), -60.0 / 20.0, 1e-9);  // no wall here
    EXPECT_NEAR(y(200.0, 200.0, 0.0), -3.0, 1e-9);           // at its foot
    EXPECT_NEAR(y(300.0, 200.0, 40.0), -3.0 - 30.0, 1e-9);
    EXPECT_NEAR(y(200.0, 200.0, 40.0), -3.0 - 0.6 * 30.0, 1e-9);
    EXPECT_NEAR(y(300.0, 200.0, 20.0), -3.0 - 30.0 / 8.0, 1e-9);
    EXPECT_NEAR(y(300.0, 220.0, 40.0), -3.0, 1e-9);  // beside it
}

// ---- in the machine

TEST(Process, StatesAndProgramCarryTheProcess) {
    twin_config config;
    config.axes[0] = {true, 0.0, 1000.0, 200.0, 1000.0, 50.0, 250.0, 1};
    config.cutting = milling();
    nc_motion nc(config);
    twin_step air, chips;
    air.target_mm[0] = 100.0, air.feed_mm_per_s = 100.0, air.spindle_rpm = 3000.0;
    chips.target_mm[0] = 200.0, chips.feed_mm_per_s = 10.0, chips.depth_of_cut_mm = 1.5;
    nc.queue(air), nc.queue(chips);
    while (nc.position_mm()[0] < 50.0) nc.step();
    EXPECT_EQ(nc.state().spindle_rpm, 3000.0);
    EXPECT_EQ(nc.state().depth_of_cut_mm, 0.0);
    while (nc.position_mm()[0] < 150.0) nc.step();
    EXPECT_EQ(nc.state().spindle_rpm, 3000.0);
    EXPECT_EQ(nc.state().depth_of_cut_mm, 1.5);
    EXPECT_NEAR(nc.state().feed_mm_per_min, 600.0, 1e-6);
    const twin_machine twin(config);
    EXPECT_LT(twin.true_error_um(nc.state())[1], -1.0);
    while (nc.moving()) nc.step();
    nc.step();
    EXPECT_EQ(nc.state().depth_of_cut_mm, 0.0);
    EXPECT_EQ(nc.state().feed_mm_per_min, 0.0);
    EXPECT_EQ(nc.state().spindle_rpm, 3000.0);
}

TEST(Process, PartsOfTheErrorFollowTheState) {
    const twin_config config = load_twin(thermal_example);
    const twin_machine twin(config);
    twin_state state = state_at({400.0, 250.0, 250.0});
    const xyz cold = twin.explained_error_um(state);
    state.temperature_degC["spindle"] = config.thermal.reference_degC + 10.0;
    const xyz warm = twin.explained_error_um(state);
    EXPECT_LT(warm[2] - cold[2], -20.0);  // it grows towards the table
    state.temperature_degC["spindle"] = config.thermal.reference_degC;
    EXPECT_NEAR(twin.explained_error_um(state)[2], cold[2], 1e-9);
}

TEST(Process, ThePlcShowsItBySignalName) {
    twin_config config = load_twin(thermal_example);
    config.program.clear();
    config.thermal.air.swing_K = 0.0;
    fakeplc::register_map map;
    map.read = {0, 12, false};
    map.write = {20, 2, false};
    map.control = 0, map.plc_heartbeat = 1, map.status = 20, map.box_heartbeat = 21;
    const auto i16 = fakeplc::number_format::parse("int16").value();
    map.signals = {{"TX_nut", 2, i16, 0.01, 0.0, {}, {}},
                   {"spindle_rpm", 3, i16, 1.0, 0.0, {}, {}},
                   {"spindle_load_percent", 4, i16, 0.1, 0.0, {}, {}},
                   {"feed_mm_per_min", 5, i16, 1.0, 0.0, {}, {}},
                   {"depth_of_cut_mm", 6, i16, 0.01, 0.0, {}, {}}};
    fakeplc::fake_plc plc(config, map, fakeplc::plc_profile::find("generic").value(), 0);
    const auto shown = [&](int address) {
        const auto reply = plc.answer({3, 0, static_cast<std::uint8_t>(address), 0, 1});
        return static_cast<std::int16_t>(reply.at(2) << 8 | reply.at(3));
    };
    plc.run_to(2000000);
    EXPECT_NEAR(shown(2), 100.0 * config.thermal.air.mean_degC, 31.0);
    EXPECT_EQ(shown(3), 0);
    twin_step cutting;
    cutting.target_mm[0] = 700.0, cutting.feed_mm_per_s = 5.0, cutting.spindle_rpm = 4000.0;
    cutting.depth_of_cut_mm = 1.0;
    plc.move(cutting);
    plc.run_to(5000000);
    EXPECT_EQ(shown(3), 4000);
    EXPECT_EQ(shown(5), 300);
    EXPECT_EQ(shown(6), 100);
    EXPECT_GT(shown(4), 40);  // idling at 4000 1/min alone is 4 %
}

// ---- mistakes

std::string thermal_complaint(const std::string &thermal,
                              const std::string &cutting = "{\"N_per_mm\": 1}") {
    const std::string path = compbox_test::temporary("thermal.json");
    formats::write_file(path, R"({"format": "compbox-twin/1", "axes": {"X": {"travel_mm": [0, 10],
        "max_velocity_mm_per_min": 1, "acceleration_mm_per_s2": 1}}, "thermal": )" +
                                  thermal + ", \"cutting\": " + cutting + "}");
    try {
        load_twin(path);
    } catch (const input_error &error) {
        return std::string(error.what()).substr(path.size() + 2);
    }
    return "none";
}

std::string with_node(const std::string &rest) {
    return R"({"nodes": {"a": {"capacity_kJ_per_K": 1, "to_air_W_per_K": 1}})" + rest + "}";
}

TEST(ProcessFile, SaysWhatIsWrongAndWhere) {
    const std::pair<std::string, std::string> thermal[] = {
        {with_node(""), "none"},
        {"7", "thermal: must be an object"},
        {"{}", "thermal.nodes: must name at least one node"},
        {R"({"nodes": {"a": {"capacity_kJ_per_K": 0, "to_air_W_per_K": 1}}})",
         "thermal.nodes.a.capacity_kJ_per_K: 0 is not between 0.01 and 1000000"},
        {R"({"nodes": {"a": {"capacity_kJ_per_K": 1, "to_air_W_per_K": 0}}})",
         "thermal.nodes.a: has no way for its heat to the air"},
        {with_node(R"(, "couplings": [{"between": ["a", "b"], "W_per_K": 1}])"),
         "thermal.couplings[0].between: 'b' is no node of this network"},
        {with_node(R"(, "couplings": [{"between": ["a", "a"], "W_per_K": 1}])"),
         "thermal.couplings[0].between: must be two different nodes"},
        {with_node(R"(, "heats": [{"node": "a", "by": "sun", "watt": 1}])"),
         "thermal.heats[0].by: must be always, spindle_rpm, travel_X, travel_Y, travel_Z or "
         "cutting_W"},
        {with_node(R"(, "expansions": [{"node": "a", "moves": "B"}])"),
         "thermal.expansions[0].moves: must be X, Y or Z"},
        {with_node(R"(, "expansions": [{"node": "a", "moves": "X", "um_per_m_K": 1}])"),
         "thermal.expansions[0].along: must be a text"},
        {with_node(R"(, "sensors": {"T": {"node": "a", "lag": 1}})"),
         "thermal.sensors.T: the key 'lag' is unknown"},
        {with_node(R"(, "air": {"warmest_h": 25})"),
         "thermal.air.warmest_h: 25 is not between 0 and 24"},
    };
    for (const auto &[text, expected] : thermal) {
        EXPECT_EQ(thermal_complaint(text).substr(0, expected.size()), expected) << text;
    }
    const std::string wall = R"({"N_per_mm": 1, "walls": [{"name": "w", "yields": "Y", "along": "X",
        "along_mm": [0, 1], "normal_mm": [0, 1], "z_mm": )";
    const std::pair<std::string, std::string> cutting[] = {
        {wall + R"([0, 1], "compliance_um_per_N": 1}]})", "none"},
        {wall + R"([1, 0], "compliance_um_per_N": 1}]})", "cutting.walls[0].z_mm: must ascend"},
        {wall + R"([0], "compliance_um_per_N": 1}]})", "cutting.walls[0].z_mm: must be [from, to]"},
        {"{}", "cutting: the key 'N_per_mm' is missing"},
        {R"({"N_per_mm": 1, "walls": [{"name": "w", "yields": "X", "along": "X"}]})",
         "cutting.walls[0]: must yield along X or Y"},
    };
    for (const auto &[text, expected] : cutting) {
        EXPECT_EQ(thermal_complaint(with_node(""), text).substr(0, expected.size()), expected)
            << text;
    }
}

}  // namespace
}  // namespace compbox::twin
