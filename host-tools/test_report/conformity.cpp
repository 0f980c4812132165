// SPDX-License-Identifier: MIT
#include "host-tools/test_report/conformity.h"

#include <algorithm>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"
#include "host-tools/test_report/figures.h"

namespace compbox::test_report {

const char *name_of(verdict one) {
    switch (one) {
        case verdict::conforms:
            return "conforms";
        case verdict::undecided:
            return "undecided";
        case verdict::does_not:
            break;
    }
    return "does not conform";
}

verdict judged(double value, double limit, const std::optional<double> &uncertainty) {
    const double guard = uncertainty.value_or(0.0);
    if (value + guard <= limit) return verdict::conforms;
    return value - guard > limit ? verdict::does_not : verdict::undecided;
}

json conformity_of(const json &figures, const by_figure &limits, const by_figure &uncertainties) {
    const std::string file = figures["file"].get<std::string>();
    for (const auto &known : uncertainties) figure_of(file, known.first);
    json result;
    verdict all = verdict::conforms;
    result["verdict"] = nullptr;
    for (const auto &[key, limit] : limits) {
        const figure &one = figure_of(file, key);
        const auto value = value_of(figures, one);
        if (!value) {
            throw input_error(file, 0, 0,
                              "has no {}, which needs {}; leave its limit out, or measure again",
                              one.symbol,
                              key.size() == 1 ? "several runs in both directions"
                                              : "several runs in this direction");
        }
        const bool known = uncertainties.count(key) > 0;
        const verdict here =
            known ? judged(*value, limit, uncertainties.at(key)) : judged(*value, limit, {});
        all = std::max(all, here);
        result["figures"].push_back({{"figure", key},
                                     {"symbol", one.symbol},
                                     {"value", *value},
                                     {"limit", limit},
                                     {"uncertainty", known ? json(uncertainties.at(key)) : json()},
                                     {"verdict", name_of(here)}});
    }
    result["verdict"] = name_of(all);
    return result;
}

}  // namespace compbox::test_report
