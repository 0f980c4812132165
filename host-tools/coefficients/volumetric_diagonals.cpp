// SPDX-License-Identifier: MIT
#include <algorithm>
#include <iterator>

#include "host-tools/coefficients/volumetric_curve.h"

extern "C" {
#include "models/volumetric.h"
}

namespace compbox::coefficients {

namespace {

// The machine of the term at the targets of diagonals.
class machine {
  public:
    // in : squareness that is given is part of it
    machine(const volumetric_options &options, const volumetric_result &result)
        : options_(options) {
        cb_volumetric_chain(options.chain.c_str(), model_.moves);
        for (std::size_t k = 0; k < 3; ++k) {
            model_.tool[k] = static_cast<float>(options.tool_direction[k]);
            const auto given = options.squareness_urad.find(squareness_names[k]);
            if (given != options.squareness_urad.end()) {
                model_.squareness_urad[k] = static_cast<float>(given->second);
            }
            const vector_mm &point = result.reference_points_mm.at(axis_names[k]);
            for (std::size_t i = 0; i < 3; ++i) {
                model_.lever_mm[k][i] = static_cast<float>(options.tool_offset_mm[i] - point[i]);
            }
        }
    }

    // out: error along the diagonal at each target, with the errors that error_at gives there
    template <typename ErrorAt>
    std::vector<double> along_um(const std::vector<diagonal_target> &targets,
                                 const cb_volumetric &model, const ErrorAt &error_at) const {
        std::vector<double> along;
        for (const diagonal_target &target : targets) {
            cb_volumetric_state state = {};
            state.tool_mm = static_cast<float>(target.tool_mm);
            for (std::size_t a = 0; a < 3; ++a) {
                state.position_mm[a] = static_cast<float>(target.position_mm[a]);
            }
            error_at(target, state.error);
            float e_um[3];
            cb_volumetric_evaluate(&model, &state, e_um);
            along.push_back(target.along[0] * double{e_um[0]} + target.along[1] * double{e_um[1]} +
                            target.along[2] * double{e_um[2]});
        }
        return along;
    }

    // out: the error along the diagonal by the curves and the squareness that is given
    std::vector<double> by_curves(const std::vector<diagonal_target> &targets,
                                  const std::vector<volumetric_curve> &curves) const {
        return along_um(targets, model_, [&](const diagonal_target &target, float *error) {
            for (const volumetric_curve &one : curves) {
                const double position = target.position_mm[one.axis()];
                error[cb_volumetric_error(one.name.c_str())] =
                    static_cast<float>(one.fitted.curve.value(position));
            }
        });
    }

    // out: squareness that is not given, and the linear part of each roll with a curve
    std::vector<diagonal_cause> causes(const std::vector<diagonal_target> &targets,
                                       const std::vector<volumetric_curve> &curves) const {
        cb_volumetric straight = model_;
        std::fill(std::begin(straight.squareness_urad), std::end(straight.squareness_urad), 0.0f);
        std::vector<diagonal_cause> made;
        for (std::size_t k = 0; k < 3; ++k) {
            if (options_.squareness_urad.count(squareness_names[k]) > 0) continue;
            cb_volumetric tilted = straight;
            tilted.squareness_urad[k] = 1.0f;
            made.push_back({diagonal_cause::squareness, squareness_names[k],
                            along_um(targets, tilted, [](const diagonal_target &, float *) {})});
        }
        for (const volumetric_curve &one : curves) {
            if (!one.is_roll()) continue;
            const auto roll = [&one](const diagonal_target &target, float *error) {
                const double position = target.position_mm[one.axis()];
                error[cb_volumetric_error(one.name.c_str())] =
                    static_cast<float>(one.rise_at(position));
            };
            made.push_back({diagonal_cause::roll, one.name, along_um(targets, straight, roll)});
        }
        return made;
    }

  private:
    const volumetric_options &options_;
    cb_volumetric model_ = {};
};

}  // namespace

void volumetric_curve::add_rise(double size) {
    const auto add = [&](const std::vector<double> &position, std::vector<double> &value) {
        for (std::size_t i = 0; i < value.size(); ++i) value[i] += size * rise_at(position[i]);
    };
    add(data.position, data.mean);
    for (fitting::measured_run &run : data.runs) add(run.position, run.error);
}

void adjust_to_diagonals(const volumetric_options &options, std::vector<volumetric_curve> &curves,
                         volumetric_result &result) {
    const auto length_mm = options.tool_length_signal.empty()
                               ? std::optional<double>(options.tool_length_mm)
                               : std::nullopt;
    std::vector<diagonal_target> targets = read_diagonals(options.diagonals, length_mm);
    const machine own(options, result);
    if (!options.compensated) {
        const std::vector<double> known = own.by_curves(targets, curves);
        for (std::size_t r = 0; r < targets.size(); ++r) targets[r].error_um -= known[r];
    }
    result.diagonals = adjust_diagonals(targets, own.causes(targets, curves));
    for (volumetric_curve &one : curves) {
        const auto roll = result.diagonals->found.find(one.name);
        if (roll == result.diagonals->found.end()) continue;
        one.add_rise(roll->second.value);
        one.fit(options);
    }
    for (const auto &name : result.diagonals->hidden) {
        result.remarks.push_back(name[0] == 'E'
                                     ? "the diagonals do not show the linear part of " + name +
                                           ", or show it as squareness: zero"
                                     : "the diagonals do not show " + name +
                                           ", which needs both diagonals of a face: zero");
    }
}

}  // namespace compbox::coefficients
