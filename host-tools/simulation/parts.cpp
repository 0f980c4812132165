// SPDX-License-Identifier: MIT
#include "host-tools/simulation/parts.h"

#include <algorithm>
#include <filesystem>

#include "host-tools/formats/error.h"
#include "host-tools/formats/json.h"

namespace compbox::simulation {

namespace {

// Reads one object of the file; each error message begins with its place.
struct source {
    const json &value;
    const std::string &file;
    std::string place;

    source(const json &object, const std::string &path, const std::string &where)
        : value(object), file(path), place(where) {
        if (!value.is_object()) fail("must be an object");
    }
    [[noreturn]] void fail(const std::string &why) const {
        throw input_error(file, 0, 0, "{}: {}", place, why);
    }
    void keys(std::initializer_list<const char *> allowed) const {
        formats::only_keys(value, allowed, file, place);
    }
    std::string text(const char *key) const { return formats::get<std::string>(value, key, file); }
    std::vector<std::string> texts(const char *key) const {
        return formats::get_or(value, key, std::vector<std::string>(), file);
    }
    double number(const char *key, double otherwise, double low, double high) const {
        const double found = formats::get_or(value, key, otherwise, file);
        if (!(found >= low && found <= high)) fail(fmt::format("{} is out of range", key));
        return found;
    }
    std::array<double, 2> range(const char *key) const {
        const auto list = formats::get<std::vector<double>>(value, key, file);
        if (list.size() != 2 || !(list[0] < list[1])) {
            fail(fmt::format("{} must be [from, to], ascending", key));
        }
        return {list[0], list[1]};
    }
};

part_surface surface_of(const source &from) {
    from.keys({"name", "x_mm", "y_mm", "z_mm", "bow_mm", "columns", "rows"});
    part_surface surface;
    surface.name = from.text("name");
    surface.x_mm = from.range("x_mm");
    surface.z_mm = from.range("z_mm");
    surface.y_mm = from.number("y_mm", 0.0, -1e5, 1e5);
    surface.bow_mm = from.number("bow_mm", 0.0, -1e4, 1e4);
    surface.columns = static_cast<int>(from.number("columns", 10.0, 2.0, 1000.0));
    surface.rows = static_cast<int>(from.number("rows", 10.0, 2.0, 1000.0));
    return surface;
}

part_work work_of(const source &from) {
    part_work work;
    work.spindle_rpm = from.number("spindle_rpm", 0.0, 0.0, 1e6);
    if (from.value.contains("part")) {
        from.keys({"part", "spindle_rpm", "feed_mm_per_min", "depth_mm"});
        work.part = from.text("part");
        work.feed_mm_per_min = from.number("feed_mm_per_min", 0.0, 1.0, 1e5);
        work.depth_mm = from.number("depth_mm", 0.0, 0.0, 100.0);
        return work;
    }
    from.keys({"minutes", "spindle_rpm", "travel_mm_per_min"});
    work.minutes = from.number("minutes", 0.0, 0.01, 1e5);
    work.travel_mm_per_min = from.number("travel_mm_per_min", 0.0, 0.0, 1e5);
    return work;
}

// in : air of a day without "air". Throws input_error for an unknown key or a value out of range.
part_day day_of(const source &from, const twin::thermal_air &usual) {
    from.keys({"air", "work"});
    part_day day;
    day.air = usual;
    if (from.value.contains("air")) {
        const source air(from.value["air"], from.file, from.place + ".air");
        air.keys({"mean_degC", "swing_K", "warmest_h", "start_h"});
        day.air.mean_degC = air.number("mean_degC", usual.mean_degC, -40.0, 80.0);
        day.air.swing_K = air.number("swing_K", usual.swing_K, 0.0, 40.0);
        day.air.warmest_h = air.number("warmest_h", usual.warmest_h, 0.0, 24.0);
        day.air.start_h = air.number("start_h", usual.start_h, 0.0, 24.0);
    }
    for (const auto &one : formats::get<json>(from.value, "work", from.file)) {
        day.work.push_back(work_of(source(one, from.file, from.place + ".work[]")));
    }
    return day;
}

// "work": "OTHER": the same work as on another day.
void read_days(const source &root, const twin::thermal_air &usual, part_scenario &plan) {
    json days = formats::get<json>(root.value, "days", root.file);
    if (!days.is_object()) root.fail("days must be an object");
    for (auto &[name, value] : days.items()) {
        if (value.is_object() && value.contains("work") && value["work"].is_string()) {
            const std::string other = value["work"];
            if (!days.contains(other) || !days[other].contains("work") ||
                !days[other]["work"].is_array()) {
                root.fail(fmt::format("days.{}.work: there is no work of a day '{}'", name, other));
            }
            value["work"] = days[other]["work"];
        }
        plan.days[name] = day_of(source(value, root.file, "days." + name), usual);
    }
}

bool has_part(const part_day &day, const std::string &name) {
    return std::any_of(day.work.begin(), day.work.end(),
                       [&](const part_work &work) { return work.part == name; });
}

// out: parts and surfaces of a day; throws input_error for one that the scenario lacks
part_choice choice_of(const source &from, const part_scenario &plan) {
    from.keys({"name", "day", "parts", "surfaces"});
    part_choice choice;
    choice.day = from.text("day");
    choice.name = formats::get_or(from.value, "name", choice.day, from.file);
    choice.parts = from.texts("parts");
    choice.surfaces = from.texts("surfaces");
    const auto day = plan.days.find(choice.day);
    if (day == plan.days.end()) from.fail(fmt::format("there is no day '{}'", choice.day));
    for (const auto &part : choice.parts) {
        if (!has_part(day->second, part)) from.fail(fmt::format("that day has no part '{}'", part));
    }
    for (const auto &name : choice.surfaces) {
        const bool known = std::any_of(plan.surfaces.begin(), plan.surfaces.end(),
                                       [&](const auto &surface) { return surface.name == name; });
        if (!known) from.fail(fmt::format("there is no surface '{}'", name));
    }
    return choice;
}

part_method method_of(const source &from) {
    from.keys({"name", "steps", "mean_only"});
    part_method method;
    method.name = from.text("name");
    method.steps = from.texts("steps");
    method.mean_only = formats::get_or(from.value, "mean_only", false, from.file);
    if (method.steps.empty() != method.mean_only) from.fail("needs steps, or mean_only");
    return method;
}

// in : plan with days and surfaces. Throws input_error, also for a protocol without a method.
part_protocol protocol_of(const source &from, const part_scenario &plan) {
    from.keys({"name", "train", "steps", "methods", "judge", "also", "outside"});
    part_protocol protocol;
    protocol.name = from.text("name");
    const auto choice = [&](const json &value, const std::string &key) {
        return choice_of(source(value, from.file, from.place + "." + key), plan);
    };
    protocol.train = choice(formats::get<json>(from.value, "train", from.file), "train");
    protocol.judge = choice(formats::get<json>(from.value, "judge", from.file), "judge");
    for (const auto &[key, list] :
         {std::pair{"also", &protocol.also}, std::pair{"outside", &protocol.outside}}) {
        for (const auto &one : formats::get_or(from.value, key, json::array(), from.file)) {
            list->push_back(choice(one, std::string(key) + "[]"));
        }
    }
    protocol.steps = from.texts("steps");
    for (const auto &one : formats::get<json>(from.value, "methods", from.file)) {
        protocol.methods.push_back(method_of(source(one, from.file, from.place + ".methods[]")));
    }
    if (protocol.methods.empty()) from.fail("needs at least one method");
    return protocol;
}

// Reads "probe" and "pace", both optional. Throws input_error for a value out of range.
void read_probe_and_pace(const source &root, part_scenario &plan) {
    if (root.value.contains("probe")) {
        const source probe(root.value["probe"], root.file, "probe");
        probe.keys({"noise_um", "repeatability_um", "resolution_um"});
        plan.probe.noise_um = probe.number("noise_um", 1.0, 0.0, 1e3);
        plan.probe.repeatability_um = probe.number("repeatability_um", 0.5, 0.0, 1e3);
        plan.probe.resolution_um = probe.number("resolution_um", 0.1, 1e-6, 100.0);
    }
    if (root.value.contains("pace")) {
        const source pace(root.value["pace"], root.file, "pace");
        pace.keys({"period_ms", "scan_ms", "interpolation_ms", "record_s", "idle_record_s"});
        plan.pace.period_ms = pace.number("period_ms", 600.0, 1.0, 1000.0);
        plan.pace.scan_ms = pace.number("scan_ms", 200.0, 1.0, 1000.0);
        plan.pace.interpolation_ms = pace.number("interpolation_ms", 100.0, 1.0, 100.0);
        plan.pace.record_s = pace.number("record_s", 1.2, 0.001, 60.0);
        plan.pace.idle_record_s = pace.number("idle_record_s", 12.0, 0.001, 600.0);
    }
}

}  // namespace

part_scenario load_part_scenario(const std::string &path) {
    const json value = formats::read_json(path);
    const source root(value, path, "the scenario");
    root.keys({"format", "kind", "name", "twin", "machine", "seeds", "surfaces", "probe", "pace",
               "days", "protocols", "paper_percent"});
    const auto beside = [&](const std::string &name) {
        return (std::filesystem::path(path).parent_path() / name).string();
    };
    part_scenario plan;
    plan.file = path;
    plan.name = root.text("name");
    plan.twin = beside(root.text("twin"));
    plan.machine = beside(root.text("machine"));
    plan.seeds = formats::get_or(value, "seeds", plan.seeds, path);
    plan.paper_percent = formats::get_or(value, "paper_percent", 0.0, path);
    for (const auto &one : formats::get<json>(value, "surfaces", path)) {
        plan.surfaces.push_back(surface_of(source(one, path, "surfaces[]")));
    }
    read_probe_and_pace(root, plan);
    read_days(root, twin::load_twin(plan.twin).thermal.air, plan);
    for (const auto &one : formats::get<json>(value, "protocols", path)) {
        plan.protocols.push_back(protocol_of(source(one, path, "protocols[]"), plan));
    }
    if (plan.surfaces.empty() || plan.protocols.empty()) {
        root.fail("needs at least one surface and one protocol");
    }
    return plan;
}

}  // namespace compbox::simulation
