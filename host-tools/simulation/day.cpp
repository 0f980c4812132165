// SPDX-License-Identifier: MIT
#include "host-tools/simulation/day.h"

#include <algorithm>
#include <cmath>

#include "host-tools/coefficients/load.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/simulation/world.h"

namespace compbox::simulation {

namespace {

constexpr double run_up_mm = 10.0;     // before and after a line of cut
constexpr double clearance_mm = 20.0;  // from the wall, when moving to the next line
constexpr double rapid_mm_per_min = 5000.0;
constexpr double free_share = 0.2;  // share of a travel at each end that idle axes leave free
constexpr double s_per_min = 60.0;
constexpr double most_moves = 1e6;   // of idle axes
constexpr double after_cut_s = 5.0;  // with dense rows in the record

// ---- the program

// A place on a surface.
twin::xyz on(const part_surface &surface, double x_mm, double z_mm) {
    const double u = 2.0 * (x_mm - surface.x_mm[0]) / (surface.x_mm[1] - surface.x_mm[0]) - 1.0;
    return {x_mm, surface.y_mm + surface.bow_mm * (1.0 - u * u), z_mm};
}

// The moves of a day, for the NC.
class programmer {
  public:
    programmer(const part_day &day, const std::vector<part_surface> &surfaces,
               const twin::twin_config &machine)
        : surfaces_(surfaces), machine_(machine) {
        for (const auto &work : day.work) add(work);
    }

    const std::vector<twin::twin_step> &steps() const { return steps_; }

  private:
    void add(const part_work &work) {
        spindle_rpm_ = work.spindle_rpm;
        if (!work.part.empty()) {
            for (const auto &surface : surfaces_) cut_surface(work, surface);
        } else if (work.travel_mm_per_min > 0.0) {
            run_axes(work);
        } else {
            twin::twin_step rest;
            rest.dwell_s = s_per_min * work.minutes;
            push(rest);
        }
    }

    void push(twin::twin_step step) {
        step.spindle_rpm = spindle_rpm_;
        steps_.push_back(step);
    }

    void move_to(const twin::xyz &target_mm, double feed_mm_per_min, double depth_mm) {
        twin::twin_step step;
        for (std::size_t a = 0; a < 3; ++a) step.target_mm[a] = target_mm[a];
        step.feed_mm_per_s = feed_mm_per_min / s_per_min;
        step.depth_of_cut_mm = depth_mm;
        push(step);
    }

    // Cuts lines from the foot upwards. Moves of a line meet between the probed points, so that the
    // tool passes the points at full feed.
    void cut_surface(const part_work &work, const part_surface &surface) {
        const double step_mm = (surface.x_mm[1] - surface.x_mm[0]) / (surface.columns - 1);
        for (int row = 0; row < surface.rows; ++row) {
            const double z_mm =
                surface.z_mm[0] + (surface.z_mm[1] - surface.z_mm[0]) * row / (surface.rows - 1);
            const double start_mm = surface.x_mm[0] - run_up_mm;
            move_to({start_mm, surface.y_mm - clearance_mm, z_mm}, rapid_mm_per_min, 0.0);
            move_to(on(surface, start_mm, z_mm), rapid_mm_per_min, 0.0);
            for (int column = 0; column < surface.columns; ++column) {
                const double end_mm = column + 1 < surface.columns
                                          ? surface.x_mm[0] + (column + 0.5) * step_mm
                                          : surface.x_mm[1] + run_up_mm;
                move_to(on(surface, end_mm, z_mm), work.feed_mm_per_min, work.depth_mm);
            }
            const double end_mm = surface.x_mm[1] + run_up_mm;
            move_to({end_mm, surface.y_mm - clearance_mm, z_mm}, rapid_mm_per_min, 0.0);
        }
    }

    // Moves to and fro along the diagonal of the travels for work.minutes.
    void run_axes(const part_work &work) {
        twin::xyz low = {}, high = {};
        double length_mm = 0.0;
        for (std::size_t a = 0; a < 3; ++a) {
            const twin::twin_axis &axis = machine_.axes[a];
            const double free_mm = free_share * (axis.max_mm - axis.min_mm);
            low[a] = axis.min_mm + free_mm, high[a] = axis.max_mm - free_mm;
            length_mm = std::hypot(length_mm, high[a] - low[a]);
        }
        const double wanted = work.minutes * work.travel_mm_per_min / length_mm;
        if (!(wanted < most_moves)) {
            throw input_error(machine_.file, 0, 0,
                              "the axes would move to and fro more than a million times in {} "
                              "minutes at travel_mm_per_min {}: their travel is too short",
                              work.minutes, work.travel_mm_per_min);
        }
        const int times = std::max(1, static_cast<int>(std::lround(wanted)));
        for (int i = 0; i < times; ++i) move_to(i % 2 ? low : high, work.travel_mm_per_min, 0.0);
    }

    const std::vector<part_surface> &surfaces_;
    const twin::twin_config &machine_;
    double spindle_rpm_ = 0.0;
    std::vector<twin::twin_step> steps_;
};

// ---- the points on the way

// Probed points in the order in which they are cut.
class point_watch {
  public:
    point_watch(const part_day &day, const std::vector<part_surface> &surfaces) {
        for (const auto &work : day.work) {
            for (const auto &surface : surfaces) {
                if (!work.part.empty()) add(work.part, surface);
            }
        }
    }

    bool done() const { return next_ == expected_.size(); }
    std::string next_name() const {
        return fmt::format("{}, {}", expected_[next_].part, expected_[next_].surface);
    }

    // Records the next point if the tool has just passed it.
    void look(const fakeplc::fake_plc &plc, std::vector<cut_point> &passed) {
        if (done() || plc.nc().state().depth_of_cut_mm <= 0.0) return;
        const cut_point &point = expected_[next_];
        const twin::xyz &now_mm = plc.nc().position_mm();
        if (std::fabs(now_mm[2] - point.position_mm[2]) > 1e-3 ||
            std::fabs(now_mm[1] - point.position_mm[1]) > 0.5 * clearance_mm ||
            now_mm[0] < point.position_mm[0]) {
            return;
        }
        passed.push_back(point);
        cut_point &cut = passed.back();
        twin::twin_state state = plc.machine_state();
        cut.time_s = state.time_s;
        cut.position_mm = now_mm;
        cut.after_um = plc.twin().true_error_um(state);
        state.drive_um = {};
        cut.before_um = plc.twin().true_error_um(state);
        cut.unexplained_um = cut.before_um;
        const twin::xyz explained = plc.twin().explained_error_um(state);
        for (std::size_t a = 0; a < 3; ++a) cut.unexplained_um[a] -= explained[a];
        ++next_;
    }

  private:
    void add(const std::string &part, const part_surface &surface) {
        for (int row = 0; row < surface.rows; ++row) {
            for (int column = 0; column < surface.columns; ++column) {
                const double s = static_cast<double>(column) / (surface.columns - 1);
                const double t = static_cast<double>(row) / (surface.rows - 1);
                cut_point point;
                point.part = part;
                point.surface = surface.name;
                point.position_mm =
                    on(surface, surface.x_mm[0] + s * (surface.x_mm[1] - surface.x_mm[0]),
                       surface.z_mm[0] + t * (surface.z_mm[1] - surface.z_mm[0]));
                expected_.push_back(point);
            }
        }
    }

    std::vector<cut_point> expected_;
    std::size_t next_ = 0;
};

// ---- the record, with the columns that compboxd writes

double seconds(std::int64_t us) {
    return 1e-6 * static_cast<double>(us);
}

std::string record_header(const cb_config &config) {
    std::string text = "time_s";
    for (unsigned i = 0; i < config.signals_count; ++i)
        text += fmt::format(",{}", config.signals[i].name);
    for (unsigned i = 0; i < config.outputs_count; ++i)
        text += fmt::format(",{}", config.outputs[i].name);
    for (unsigned i = 0; i < config.channels_count; ++i) {
        text += fmt::format(",comp_{}_um", config.channels[i].name);
    }
    return text + ",mode,reason\n";
}

std::string record_row(const world &at) {
    const cb_box &box = at.box();
    std::string text = fmt::format("{}", seconds(at.now_us()));
    for (unsigned i = 0; i < box.config.signals_count; ++i) {
        text += box.signals[i].known ? fmt::format(",{}", box.signals[i].value) : ",";
    }
    for (unsigned i = 0; i < box.config.outputs_count; ++i) {
        text += fmt::format(",{}", box.outputs[i]);
    }
    for (unsigned i = 0; i < box.config.channels_count; ++i) {
        text += fmt::format(",{}", at.outputs().channel_um[i]);
    }
    return fmt::format("{},{},{}\n", text, static_cast<int>(box.mode.mode),
                       static_cast<int>(box.mode.reason));
}

// Adds rows to the record: dense while a part is cut and for after_cut_s after it.
class recorder {
  public:
    recorder(const cb_config &config, const part_pace &pace)
        : pace_(pace), text_(record_header(config)) {}

    // Called after each cycle of the box.
    void look(world &at) {
        const double time_s = seconds(at.now_us());
        if (at.plc().nc().state().depth_of_cut_mm > 0.0) cut_s_ = time_s;
        const bool cutting = time_s - cut_s_ < after_cut_s;
        const double every_s = cutting ? pace_.record_s : pace_.idle_record_s;
        if (time_s - recorded_s_ < every_s - 1e-6) return;
        text_ += record_row(at);
        recorded_s_ = time_s;
    }

    std::string text() && { return std::move(text_); }

  private:
    part_pace pace_;
    double recorded_s_ = -1e9, cut_s_ = -1e9;
    std::string text_;
};

// Writes the coefficient file with the period of the pace, and lead and heartbeat timeout to match.
// out: path of the new file
std::string slowed(const std::string &coefficients, const part_pace &pace,
                   const std::string &folder) {
    json file = formats::read_json(coefficients);
    file["cycle"]["period_ms"] = pace.period_ms;
    file["cycle"]["lead_ms"] = std::min(500.0, 0.5 * (pace.period_ms + pace.scan_ms));
    file["plc"]["heartbeat_timeout_ms"] = 4.0 * pace.period_ms;
    const std::string path = folder + "/slowed.json";
    formats::write_file(path, formats::json_text(file));
    return path;
}

twin::twin_config paced(twin::twin_config machine, const part_day &day, const part_pace &pace) {
    constexpr double s_per_ms = 1e-3;
    machine.thermal.air = day.air;
    machine.nc.interpolation_s = s_per_ms * pace.interpolation_ms;
    machine.plc.scan_s = s_per_ms * pace.scan_ms;
    machine.plc.watchdog_s = std::max(machine.plc.watchdog_s, 4.0 * s_per_ms * pace.period_ms);
    return machine;
}

}  // namespace

worked_day work_a_day(const part_scenario &plan, const part_day &day,
                      const twin::twin_config &machine, const std::string &coefficients,
                      const std::string &folder) {
    const std::string slow_file = slowed(coefficients, plan.pace, folder);
    const auto config = coefficients::load_coefficients(slow_file);
    const twin::twin_config slow_machine = paced(machine, day, plan.pace);
    world at(*config, slow_machine, fakeplc::load_register_map(slow_file));
    point_watch watch(day, plan.surfaces);
    recorder record(*config, plan.pace);
    worked_day result;
    at.hooks.after_scan = [&](const fakeplc::plc_state &) { watch.look(at.plc(), result.points); };
    at.hooks.after_box_cycle = [&] { record.look(at); };
    at.wait_until_active();
    const programmer program(day, plan.surfaces, slow_machine);
    for (const auto &step : program.steps()) at.plc().move(step);
    while (at.plc().moving()) at.cycle();
    if (!watch.done()) {
        throw input_error(plan.file, 0, 0, "the tool never passed a point of {}",
                          watch.next_name());
    }
    result.record = std::move(record).text();
    return result;
}

twin::xyz touch_probe::touch(const twin::xyz &error_um) {
    // A whole number of steps in 1 µm gives the shortest decimals; there is none above 1 µm.
    const double per_um = 1.0 / probe_.resolution_um;
    const double steps = per_um < 1.0 ? per_um : std::round(per_um);
    twin::xyz shown = error_um;
    for (double &value : shown) {
        value += probe_.noise_um * noise_.normal() + probe_.repeatability_um * noise_.normal();
        value = std::round(value * steps) / steps;
    }
    return shown;
}

}  // namespace compbox::simulation
