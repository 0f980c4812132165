// SPDX-License-Identifier: MIT
#include "host-tools/simulation/paths.h"

#include <cmath>
#include <filesystem>

#include "host-tools/coefficients/load.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/simulation/tool_steps.h"
#include "host-tools/simulation/travels.h"

namespace compbox::simulation {

namespace {

// out: folder of the measurements: the scenario's for the twin file's own seed, else new ones of
//      the virtual laser
std::string measurements_of(const scenario &plan, const twin::twin_machine &twin,
                            std::uint64_t own_seed, const std::string &folder) {
    if (twin.config().seed == own_seed && !plan.measurements.empty()) return plan.measurements;
    const std::string measurements = folder + "/measurements";
    formats::make_folder(measurements);
    twin::measure_all(twin, measurements);
    return measurements;
}

// Throws input_error, naming file and path, if an end of a path is beyond the travels.
void check_travel(const scenario &plan, const twin::twin_config &config) {
    for (const auto &path : plan.paths) {
        for (std::size_t a = 0; a < 3; ++a) {
            const auto &axis = config.axes[a];
            for (const double position_mm : {path.from_mm[a], path.to_mm[a]}) {
                if (axis.present && position_mm >= axis.min_mm && position_mm <= axis.max_mm)
                    continue;
                if (!axis.present && position_mm == 0.0) continue;
                throw input_error(
                    plan.file, 0, 0, "the path {} goes to {} = {} mm, but the machine has {} to {}",
                    path.name, twin::axis_letters[a], position_mm, axis.min_mm, axis.max_mm);
            }
        }
    }
}

std::map<std::string, std::string> names_of(const scenario &plan, const std::string &once,
                                            const std::string &seed, const std::string &out) {
    const std::string here = std::filesystem::path(plan.file).parent_path().string();
    return {{"once", once},
            {"seed", seed},
            {"out", out},
            {"machine", plan.machine},
            {"here", here.empty() ? "." : here}};
}

void run_steps(const std::vector<std::string> &steps, const step_world &world, simulation &result) {
    for (const auto &step : steps) {
        const auto warnings = run_step(step, world);
        result.warnings.insert(result.warnings.end(), warnings.begin(), warnings.end());
    }
}

// Runs the scenario on one machine and appends the results.
class seed_run {
  public:
    // in : once: folder of the steps before the first seed
    seed_run(const scenario &plan, const twin::twin_config &config, const std::string &once,
             step_commands commands)
        : plan_(plan),
          config_(config),
          commands_(commands),
          once_(once),
          folder_(fmt::format("{}/seed-{}", once, config.seed)),
          twin_(config_) {
        formats::make_folder(folder_);
        for (const auto &path : plan.paths) paths_.emplace_back(twin_, path);
    }

    void measure(std::uint64_t own_seed, simulation &result) {
        if (plan_.steps.empty()) {
            measurements_ = measurements_of(plan_, twin_, own_seed, folder_);
        } else {
            run_steps(plan_.steps, steps_in(folder_), result);
        }
    }

    // in : shipped: the product's method, which is judged in motion too
    void try_method(const scenario_method &method, bool shipped, simulation &result) {
        const coefficients::fitted_files fit = coefficients_of(method, result);
        const bool first_seed = result.drawn.size() < plan_.methods.size();
        if (first_seed) result.drawn.push_back({method.name, fit.curves});
        const auto config = coefficients::load_coefficients(fit.coefficients);
        const fakeplc::register_map map = fakeplc::load_register_map(fit.coefficients);
        for (auto &path : paths_) {
            tell_place(method.name, path, [&] {
                world at(*config, config_, map, wire());
                const auto states = states_at(at, path.stops_mm(), plan_.feed_mm_per_s);
                const path_figures found = path.judge(states, *config);
                result.runs.push_back({config_.seed, method.name, path.name(), fit.coefficients,
                                       fit.coefficient_count, found.figures, path.stops_mm(),
                                       found.before_um, found.after_um});
                for (const double feed : plan_.moving_mm_per_min) {
                    if (shipped) move_along(path, feed, *config, map, result);
                }
            });
        }
    }

  private:
    wire_times wire() const {
        return {std::llround(1e3 * plan_.read_ms), std::llround(1e3 * plan_.write_ms)};
    }

    step_world steps_in(const std::string &out) const {
        formats::make_folder(out);
        return {twin_, plan_.file, names_of(plan_, once_, folder_, out), commands_};
    }

    coefficients::fitted_files coefficients_of(const scenario_method &method, simulation &result) {
        const std::string out = folder_ + "/" + method.name;
        coefficients::fitted_files fit;
        if (method.steps.empty()) {
            fit = coefficients::fit_files(measurements_, plan_.curves, method.recipe, plan_.machine,
                                          out);
            result.warnings.insert(result.warnings.end(), fit.warnings.begin(), fit.warnings.end());
            return fit;
        }
        run_steps(method.steps, steps_in(out), result);
        fit.coefficients = out + "/coefficients.json";
        return fit;
    }

    void move_along(const remeasured_path &path, double feed, const cb_config &config,
                    const fakeplc::register_map &map, simulation &result) const {
        const travel way{path.path().from_mm, path.path().to_mm, feed / 60.0};
        world at(config, config_, map, wire());
        const auto states = states_along(at, way);
        const auto after = true_errors(twin_, states);
        const auto before = true_errors(twin_, uncompensated(states));
        std::vector<twin::xyz> places;
        for (const auto &state : states) places.push_back(state.position_mm);
        moving_run one{config_.seed, path.name(), feed, at.lead_ms()};
        for (std::size_t a = 0; a < 3; ++a) {
            one.before_um[a] = range_along(path.path(), places, before, a);
            one.after_um[a] = range_along(path.path(), places, after, a);
        }
        result.moving.push_back(one);
    }

    // Adds seed, method and path to the message of an error.
    template <typename work>
    void tell_place(const std::string &method, const remeasured_path &path, work run) const {
        try {
            run();
        } catch (const input_error &error) {
            throw input_error(plan_.file, 0, 0, "seed {}, method {}, path {}: {}", config_.seed,
                              method, path.name(), error.what());
        }
    }

    const scenario &plan_;
    twin::twin_config config_;
    step_commands commands_;
    std::string once_, folder_;
    twin::twin_machine twin_;
    std::vector<remeasured_path> paths_;
    std::string measurements_;
};

}  // namespace

simulation simulate(const scenario &plan, const std::string &folder, step_commands commands,
                    const std::function<void(const std::string &)> &progress) {
    twin::twin_config config = twin::load_twin(plan.twin);
    check_travel(plan, config);
    check_stops(plan);
    const std::uint64_t own_seed = config.seed;
    std::vector<std::uint64_t> seeds = plan.seeds;
    if (seeds.empty()) seeds.push_back(own_seed);
    simulation result;
    if (!plan.once.empty()) {
        formats::make_folder(folder);
        const twin::twin_machine twin(config);
        run_steps(plan.once, {twin, plan.file, names_of(plan, folder, folder, folder), commands},
                  result);
    }
    for (const std::uint64_t seed : seeds) {
        const std::string name = fmt::format("seed {}", seed);
        progress(name + ": measure");
        config.seed = seed;
        seed_run run(plan, config, folder, commands);
        run.measure(own_seed, result);
        for (const auto &method : plan.methods) {
            progress(name + ": " + method.name);
            run.try_method(method, &method == &plan.methods.front(), result);
        }
    }
    return result;
}

}  // namespace compbox::simulation
