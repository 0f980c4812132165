// SPDX-License-Identifier: MIT
#include "host-tools/test_report/temperature.h"

#include <fmt/core.h>

#include <cmath>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/metrology/temperature.h"

namespace compbox::test_report {

namespace {

// Within this range of 20 °C a steel scale of a metre changes by about a micrometre.
constexpr double near_20_K = 0.1;

std::string degrees(const formats::start_and_end &material) {
    const std::string start = fmt::format("{:.2f}", material.start);
    const std::string end = fmt::format("{:.2f}", material.end);
    return (start == end ? start : start + " to " + end) + " °C";
}

bool is_along(const fitting::measurement &data, const std::string &name) {
    const std::string &file = data.file;
    const bool straightness_file = file.size() > 4 && file.compare(file.size() - 4, 4, ".rts") == 0;
    return name.empty() ? !straightness_file : name[1] == name[2];
}

// Takes the expansion off each run, with its own temperature, and averages anew.
void convert_runs(fitting::measurement &data, double expansion,
                  const formats::start_and_end &material) {
    const double origin_mm = data.from();
    for (std::size_t r = 0; r < data.runs.size(); ++r) {
        fitting::measured_run &run = data.runs[r];
        run.offset = run.slope = 0.0;
        metrology::convert_to_20_degC(run.position, run.error, origin_mm, expansion,
                                      metrology::degC_of_run(material, r, data.runs.size()));
    }
    fitting::average_runs(data);
}

// out: the remark on readings of a warm machine that are not converted; "" near 20 °C
std::string warm_remark(const scale_temperature &known) {
    if (!known.degC) return "";
    const double mean = 0.5 * (known.degC->start + known.degC->end);
    if (std::fabs(mean - metrology::reference_degC) < near_20_K) return "";
    return "measured at " + degrees(*known.degC) +
           " and not converted to 20 °C; --expansion-um-per-m-K converts";
}

}  // namespace

scale_temperature completed(const scale_temperature &stated, const fitting::measurement &data) {
    scale_temperature all = stated;
    if (!data.environment) return all;
    if (!all.expansion_um_per_m_K && data.environment->material_compensated()) {
        all.expansion_um_per_m_K = data.environment->expansion_um_per_m_K;
    }
    if (!all.degC) all.degC = data.environment->mean_material_degC();
    return all;
}

json convert_to_20_degC(fitting::measurement &data, const scale_temperature &stated,
                        const std::string &name) {
    json done;
    done["converted"] = false;
    if (data.unit != "um" && stated.expansion_um_per_m_K) {
        throw input_error(data.file, 0, 0,
                          "holds angles, which do not expand; leave --expansion-um-per-m-K out");
    }
    if (data.unit != "um" || !is_along(data, name)) return done;
    const scale_temperature known = completed(stated, data);
    if (data.environment && data.environment->material_compensated()) {
        done["converted_by_instrument"] = true;
        if (!stated.expansion_um_per_m_K) return done;
        done["warnings"].push_back(fmt::format(
            "the instrument converted its readings to 20 °C already, by {:g} um/m per K; {:g} is "
            "not applied, which would correct the expansion twice",
            *data.environment->expansion_um_per_m_K, *stated.expansion_um_per_m_K));
        return done;
    }
    if (!stated.expansion_um_per_m_K) {
        const std::string remark = warm_remark(known);
        if (!remark.empty()) done["remarks"].push_back(remark);
        return done;
    }
    if (!known.degC) {
        throw input_error(
            data.file, 0, 0,
            "states no material temperature, which --expansion-um-per-m-K needs; give "
            "--material-degC");
    }
    const double expansion = *stated.expansion_um_per_m_K;
    const double mean = 0.5 * (known.degC->start + known.degC->end);
    const double removed = metrology::expansion_um(data.from(), data.to(), expansion, mean);
    convert_runs(data, expansion, *known.degC);
    done["converted"] = true;
    done["expansion_um_per_m_K"] = expansion;
    done["degC"] = {known.degC->start, known.degC->end};
    done["removed_um"] = removed;
    done["remarks"].push_back(
        fmt::format("converted to 20 °C by {:g} um/m per K from {}: {:.2f} um less over the travel",
                    expansion, degrees(*known.degC), removed));
    return done;
}

void add_conversion(json &figures, const json &done) {
    figures["temperature"] = done;
    figures["temperature"].erase("remarks");
    figures["temperature"].erase("warnings");
    if (done.contains("remarks")) {
        for (const json &remark : done["remarks"]) {
            figures["positioning"]["remarks"].push_back(remark);
        }
    }
    if (done.contains("warnings")) {
        for (const json &warning : done["warnings"]) figures["warnings"].push_back(warning);
    }
}

}  // namespace compbox::test_report
