// SPDX-License-Identifier: MIT
#include "host-tools/simulation/protocols.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "host-tools/coefficients/build.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/simulation/tool_steps.h"

namespace compbox::simulation {

namespace {

bool is_in(const std::vector<std::string> &names, const std::string &name) {
    return names.empty() || std::find(names.begin(), names.end(), name) != names.end();
}

std::vector<cut_point> chosen(const std::vector<cut_point> &points, const part_choice &choice) {
    std::vector<cut_point> some;
    for (const auto &point : points) {
        if (is_in(choice.parts, point.part) && is_in(choice.surfaces, point.surface)) {
            some.push_back(point);
        }
    }
    return some;
}

// out: CSV of the probed parts: the time at which each point was cut, as the NC program logs it,
// and
//      the error of the part there
std::string probe_csv(const std::vector<cut_point> &points, touch_probe probe) {
    std::string text = "time_s,run,error_X_um,error_Y_um,error_Z_um\n";
    for (const auto &point : points) {
        const twin::xyz shown = probe.touch(point.after_um);
        text += fmt::format("{},{}", point.time_s, point.part);
        for (const double um : shown) text += fmt::format(",{}", um);
        text += "\n";
    }
    return text;
}

void take(part_figures::four &largest, const twin::xyz &error_um) {
    double squares = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
        largest[a] = std::max(largest[a], std::fabs(error_um[a]));
        squares += error_um[a] * error_um[a];
    }
    largest[3] = std::max(largest[3], std::sqrt(squares));
}

part_figures figures_of(const std::vector<cut_point> &points, touch_probe probe) {
    part_figures figures;
    for (const auto &point : points) {
        take(figures.before_um, point.before_um);
        take(figures.after_um, point.after_um);
        take(figures.unexplained_um, point.unexplained_um);
        take(figures.touched_before_um, probe.touch(point.before_um));
        take(figures.touched_after_um, probe.touch(point.after_um));
        take(figures.touched_ideal_um, probe.touch(point.unexplained_um));
    }
    return figures;
}

json constant_term(const std::string &output, const std::string &signal, double um) {
    return {{"name", output},
            {"type", "linear"},
            {"inputs", {signal}},
            {"weights", {0.0}},
            {"constant", um}};
}

// Writes a fragment whose errors are constants.
void write_constants(const std::string &path, const std::array<double, 3> &um) {
    json terms = json::array();
    for (std::size_t a = 0; a < 3; ++a) {
        const std::string axis(1, twin::axis_letters[a]);
        terms.push_back(constant_term(fmt::format("error_{}_um", axis), axis, um[a]));
    }
    formats::write_file(path, formats::json_text({{"terms", terms}}));
}

class machine_protocols {
  public:
    machine_protocols(const part_scenario &plan, const twin::twin_config &machine,
                      const std::string &folder, step_commands commands,
                      const std::function<void(const std::string &)> &progress,
                      part_results &results)
        : plan_(plan),
          machine_(machine),
          twin_(machine),
          folder_(folder),
          commands_(commands),
          progress_(progress),
          results_(results) {
        formats::make_folder(folder);
        // The recorder is a box without compensation.
        write_constants(folder + "/nothing.json", {0.0, 0.0, 0.0});
        coefficients::build_file(
            {plan.machine, {folder + "/nothing.json"}, {}, folder + "/recorder.json", "", true});
    }

    // Measures, trains and judges each method of a protocol; writes below folder_/NAME.
    void run(const part_protocol &protocol) {
        const std::string here = folder_ + "/" + protocol.name;
        formats::make_folder(here);
        measure(protocol, here);
        steps(protocol.steps, protocol, here, here);
        for (const auto &method : protocol.methods) {
            const std::string out = here + "/" + method.name;
            formats::make_folder(out);
            progress(fmt::format("{}: {}", protocol.name, method.name));
            if (method.mean_only) {
                write_mean(here, out);
            } else {
                steps(method.steps, protocol, here, out);
            }
            judge(protocol, method, out);
        }
    }

  private:
    void progress(const std::string &what) const {
        progress_(fmt::format("seed {}: {}", machine_.seed, what));
    }

    // Cuts the training parts without compensation; writes record.csv and probe.csv.
    void measure(const part_protocol &protocol, const std::string &here) {
        progress(fmt::format("{}: {}", protocol.name, protocol.train.day));
        const worked_day day = work_a_day(plan_, plan_.days.at(protocol.train.day), machine_,
                                          folder_ + "/recorder.json", here);
        formats::write_file(here + "/record.csv", day.record);
        const touch_probe probe(plan_.probe, machine_.seed, protocol.name + " training");
        formats::write_file(here + "/probe.csv",
                            probe_csv(chosen(day.points, protocol.train), probe));
    }

    // in : here: folder of the protocol; out: folder of the method
    // Runs the steps in order. Their warnings go to the results.
    void steps(const std::vector<std::string> &lines, const part_protocol &protocol,
               const std::string &here, const std::string &out) {
        const std::string beside = std::filesystem::path(plan_.file).parent_path().string();
        const step_world world{twin_,
                               plan_.file,
                               {{"seed", here},
                                {"out", out},
                                {"machine", plan_.machine},
                                {"record", here + "/record.csv"},
                                {"probe", here + "/probe.csv"},
                                {"here", beside.empty() ? "." : beside}},
                               commands_};
        for (const auto &line : lines) {
            for (const auto &warning : run_step(line, world)) {
                results_.warnings.push_back(fmt::format("{}: {}", protocol.name, warning));
            }
        }
    }

    void write_mean(const std::string &here, const std::string &out) {
        const formats::csv_table probe = formats::read_csv(here + "/probe.csv", {"run"});
        std::array<double, 3> mean = {};
        for (std::size_t a = 0; a < 3; ++a) {
            const auto column = probe.values(fmt::format("error_{}_um", twin::axis_letters[a]));
            for (const double um : column) mean[a] += um / static_cast<double>(column.size());
        }
        write_constants(out + "/mean.json", mean);
        coefficients::build_file(
            {plan_.machine, {out + "/mean.json"}, {}, out + "/coefficients.json", "", true});
    }

    void judge(const part_protocol &protocol, const part_method &method, const std::string &out) {
        judge_by(protocol, method, out, protocol.judge, part_role::judge);
        if (&method != &protocol.methods.front()) return;
        for (const auto &one : protocol.also) judge_by(protocol, method, out, one, part_role::also);
        for (const auto &one : protocol.outside) {
            judge_by(protocol, method, out, one, part_role::outside);
        }
    }

    // in : out: folder with the method's coefficients.json; a day that the last call worked is
    // reused Appends one result with the true and probed errors of the choice, in µm.
    void judge_by(const part_protocol &protocol, const part_method &method, const std::string &out,
                  const part_choice &choice, part_role role) {
        progress(fmt::format("{}: {}: {}", protocol.name, method.name, choice.name));
        if (last_day_ != choice.day || last_method_ != out) {
            day_ = work_a_day(plan_, plan_.days.at(choice.day), machine_,
                              out + "/coefficients.json", out);
            formats::write_file(fmt::format("{}/record-{}.csv", out, choice.day), day_.record);
            last_day_ = choice.day, last_method_ = out;
        }
        part_result result;
        result.seed = machine_.seed;
        result.protocol = protocol.name, result.method = method.name, result.choice = choice.name;
        result.coefficients = out + "/coefficients.json";
        result.role = role;
        result.points = chosen(day_.points, choice);
        result.figures = figures_of(
            result.points, touch_probe(plan_.probe, machine_.seed, protocol.name + choice.name));
        results_.runs.push_back(std::move(result));
    }

    const part_scenario &plan_;
    twin::twin_config machine_;
    twin::twin_machine twin_;
    std::string folder_;
    step_commands commands_;
    const std::function<void(const std::string &)> &progress_;
    part_results &results_;
    worked_day day_;  // judged last
    std::string last_day_, last_method_;
};

}  // namespace

void run_part_protocols(const part_scenario &plan, const twin::twin_config &machine,
                        const std::string &folder, step_commands commands,
                        const std::function<void(const std::string &)> &progress,
                        part_results &results) {
    machine_protocols protocols(plan, machine, folder, commands, progress, results);
    for (const auto &protocol : plan.protocols) protocols.run(protocol);
}

}  // namespace compbox::simulation
