// SPDX-License-Identifier: MIT
#include "host-tools/simulation/kinds.h"

#include <filesystem>

#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

namespace compbox::simulation {

namespace {

struct kind {
    const char *name;
    simulate_outcome (*run)(const simulate_request &);
};
constexpr kind kinds[] = {{"paths", run_paths}, {"parts", run_parts}};

}  // namespace

simulate_outcome run_scenario(const simulate_request &request) {
    const json value = formats::read_json(request.scenario);
    if (formats::get<std::string>(value, "format", request.scenario) != "compbox-scenario/1") {
        throw input_error(request.scenario, 0, 0,
                          "is not a scenario (format is not compbox-scenario/1)");
    }
    // A scenario is untrusted: it may write only below these folders.
    const formats::writes_below guard(
        {request.folder, std::filesystem::absolute(request.scenario).parent_path().string()});
    const auto name = formats::get_or(value, "kind", std::string(kinds[0].name), request.scenario);
    std::string there;
    for (const auto &one : kinds) {
        if (name == one.name) return one.run(request);
        there += fmt::format("{}{}", there.empty() ? "" : ", ", one.name);
    }
    throw input_error(request.scenario, 0, 0, "kind: there is no '{}' (there are {})", name, there);
}

}  // namespace compbox::simulation
