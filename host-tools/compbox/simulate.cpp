// SPDX-License-Identifier: MIT
#include "host-tools/compbox/simulate.h"

#include "host-tools/compbox/load.h"
#include "host-tools/compbox/virtual_run.h"
#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

namespace compbox {

namespace {

// The measurement files of this machine: the committed ones of the twin file's own seed, else new
// ones by the virtual laser.
std::string measure(const scenario &plan, const twin_machine &twin, std::uint64_t own_seed,
                    const std::string &folder) {
    if (twin.config().seed == own_seed && !plan.measurements.empty()) return plan.measurements;
    const std::string measurements = folder + "/measurements";
    make_folder(measurements);
    measure_all(twin, measurements);
    return measurements;
}

std::vector<xyz> displacements_of(const virtual_run &run) {
    std::vector<xyz> all;
    for (const auto &stop : run.stops) all.push_back(stop.displacement_um);
    return all;
}

// Throws where an end of a path cannot be reached: names file and path.
void check_travel(const scenario &plan, const twin_config &config) {
    for (const auto &path : plan.paths) {
        for (std::size_t a = 0; a < 3; ++a) {
            const auto &axis = config.axes[a];
            for (const double position_mm : {path.from_mm[a], path.to_mm[a]}) {
                if (axis.present && position_mm >= axis.min_mm && position_mm <= axis.max_mm)
                    continue;
                if (!axis.present && position_mm == 0.0) continue;
                throw input_error(plan.file, 0, 0,
                                  "the path " + path.name + " goes to " +
                                      std::string(1, axis_letters[a]) + " = " +
                                      shortest(position_mm) + " mm, where the machine has " +
                                      shortest(axis.min_mm) + " to " + shortest(axis.max_mm));
            }
        }
    }
}

// One machine; the results are appended.
class seed_run {
  public:
    seed_run(const scenario &plan, const twin_config &config, const std::string &folder)
        : plan_(plan), config_(config), folder_(folder), twin_(config_) {
        make_folder(folder);
        for (const auto &path : plan.paths) paths_.emplace_back(twin_, path);
    }

    void measure(std::uint64_t own_seed) {
        measurements_ = compbox::measure(plan_, twin_, own_seed, folder_);
    }

    void try_method(const fit_recipe &recipe, simulation &result) {
        const fitted_files fit = fit_files(measurements_, plan_.curves, recipe, plan_.machine,
                                           folder_ + "/" + recipe.name);
        result.warnings.insert(result.warnings.end(), fit.warnings.begin(), fit.warnings.end());
        const auto config = load_coefficients(fit.coefficients);
        const register_map map = load_register_map(fit.coefficients);
        for (auto &path : paths_) {
            const virtual_run run = run_on(path, recipe, *config, map);
            const path_figures found = path.judge(displacements_of(run), *config);
            result.runs.push_back({config_.seed, recipe.name, path.name(), fit.coefficients,
                                   fit.coefficient_count, found.figures, path.stops_mm(),
                                   path.before_um(), found.after_um});
        }
    }

  private:
    // What goes wrong in a run is told with its place in the scenario.
    virtual_run run_on(const remeasured_path &path, const fit_recipe &recipe,
                       const cb_config &config, const register_map &map) const {
        try {
            return run_virtually(config, config_, map, path.stops_mm(), plan_.feed_mm_per_s);
        } catch (const input_error &error) {
            throw input_error(plan_.file, 0, 0,
                              "seed " + std::to_string(config_.seed) + ", method " + recipe.name +
                                  ", path " + path.name() + ": " + error.what());
        }
    }

    const scenario &plan_;
    twin_config config_;
    std::string folder_;
    twin_machine twin_;
    std::vector<remeasured_path> paths_;
    std::string measurements_;
};

}  // namespace

simulation simulate(const scenario &plan, const std::string &folder,
                    const std::function<void(const std::string &)> &progress) {
    twin_config config = load_twin(plan.twin);
    check_travel(plan, config);
    const std::uint64_t own_seed = config.seed;
    std::vector<std::uint64_t> seeds = plan.seeds;
    if (seeds.empty()) seeds.push_back(own_seed);
    simulation result;
    for (const std::uint64_t seed : seeds) {
        const std::string name = "seed " + std::to_string(seed);
        progress(name + ": measure");
        config.seed = seed;
        seed_run run(plan, config, folder + "/seed-" + std::to_string(seed));
        run.measure(own_seed);
        for (const auto &recipe : plan.methods) {
            progress(name + ": " + recipe.name);
            run.try_method(recipe, result);
        }
    }
    return result;
}

}  // namespace compbox
