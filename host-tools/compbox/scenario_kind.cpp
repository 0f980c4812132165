// SPDX-License-Identifier: MIT
#include "host-tools/compbox/scenario_kind.h"

#include "host-tools/formats/error.h"

namespace compbox {

namespace {

struct kind {
    const char *name;
    simulate_outcome (*run)(const simulate_request &);
};
constexpr kind kinds[] = {{"paths", run_paths}, {"parts", run_parts}};

}  // namespace

simulate_outcome run_scenario(const simulate_request &request) {
    const json value = read_json(request.scenario);
    if (get<std::string>(value, "format", request.scenario) != "compbox-scenario/1") {
        throw input_error(request.scenario, 0, 0,
                          "is not a scenario (format is not compbox-scenario/1)");
    }
    const auto name = get_or(value, "kind", std::string(kinds[0].name), request.scenario);
    std::string there;
    for (const auto &one : kinds) {
        if (name == one.name) return one.run(request);
        there += std::string(there.empty() ? "" : ", ") + one.name;
    }
    throw input_error(request.scenario, 0, 0,
                      "kind: there is no '" + name + "' (there are " + there + ")");
}

}  // namespace compbox
