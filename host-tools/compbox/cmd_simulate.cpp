// SPDX-License-Identifier: MIT
// compbox simulate: the main job on a simulated machine.
#include <unistd.h>

#include <charconv>
#include <filesystem>
#include <memory>
#include <ostream>
#include <string>

#include "host-tools/coefficients/load.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/simulation/kinds.h"
#include "host-tools/simulation/plots.h"
#include "host-tools/simulation/replay.h"

namespace compbox {

namespace {

constexpr std::uint64_t most_seeds = 10000;
constexpr std::size_t largest_recording = std::size_t{1} << 30;  // bytes

struct simulate_options {
    std::string scenario, folder, seeds, statistics, log, recording;
    bool plots = false, as_json = false;
};

// "7" or "1-20".
std::vector<std::uint64_t> parse_seeds(const std::string &text) {
    const char *end = text.data() + text.size();
    std::uint64_t first = 0, last = 0;
    auto result = std::from_chars(text.data(), end, first);
    last = first;
    if (result.ec == std::errc() && result.ptr != end && *result.ptr == '-') {
        result = std::from_chars(result.ptr + 1, end, last);
    }
    if (result.ec != std::errc() || result.ptr != end || last < first ||
        last - first >= most_seeds) {
        throw cli::usage_error("--seeds", "give one number or a range, as in 7 or 1-20");
    }
    std::vector<std::uint64_t> seeds;
    for (std::uint64_t k = 0; k <= last - first; ++k) seeds.push_back(first + k);
    return seeds;
}

// A temporary folder, removed with the object.
class temporary_folder {
  public:
    temporary_folder() {
        std::string name = (std::filesystem::temp_directory_path() / "compbox-XXXXXX").string();
        if (::mkdtemp(name.data()) == nullptr) {
            throw input_error(name, 0, 0, "cannot make a temporary folder (give one with -o)");
        }
        path_ = name;
    }
    ~temporary_folder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    temporary_folder(const temporary_folder &) = delete;
    temporary_folder &operator=(const temporary_folder &) = delete;
    const std::string &path() const { return path_; }

  private:
    std::string path_;
};

void show_progress(const std::string &text, const cli::streams &io) {
    if (io.shows_progress) io.err << "\r\033[K" << text << std::flush;
}

// in : the scenario's plots exist. out: files written
std::vector<std::string> write_results(const simulate_options &options,
                                       const simulation::simulate_outcome &result,
                                       const cli::streams &io) {
    std::vector<std::string> files{options.folder + "/report.json"};
    const std::string &report = files.front();
    formats::write_file(report, formats::json_text(result.report));
    if (!options.as_json) io.out << "\nreport: " << report << "\n";
    if (!options.plots) return files;
    const std::string plots = options.folder + "/plots";
    if (!options.log.empty()) {
        simulation::plot_log(simulation::read_plc_log(options.log),
                             plots + "/compensation-over-time.svg");
    }
    if (!options.as_json) io.out << "figures: " << plots << "/\n";
    files.push_back(plots);
    return files;
}

// in : the folder of the run. out: what the scenario is to do; progress goes to io.err
simulation::simulate_request request_of(const simulate_options &options, const std::string &folder,
                                        const cli::streams &io) {
    simulation::simulate_request request;
    request.scenario = options.scenario;
    request.folder = folder;
    if (!options.seeds.empty()) request.seeds = parse_seeds(options.seeds);
    if (!options.statistics.empty())
        request.real.statistics = formats::read_json(options.statistics);
    if (!options.log.empty())
        request.real.motion = simulation::figures_in_motion(simulation::read_plc_log(options.log));
    if (options.plots) {
        request.plots = folder + "/plots";
        formats::make_folder(request.plots);
    }
    request.commands = add_computing_commands;
    request.progress = [&io](const std::string &text) { show_progress(text, io); };
    return request;
}

// Replays a recording of inputs; throws input_error for a different output.
void run_replay(const simulate_options &options, const cli::streams &io) {
    if (!options.seeds.empty() || !options.statistics.empty() || !options.log.empty() ||
        options.plots || !options.folder.empty()) {
        throw cli::usage_error("--replay", "goes with the coefficient file alone");
    }
    const auto config = coefficients::load_coefficients(options.scenario);
    const simulation::replay_result result = simulation::replay(
        *config, options.recording, formats::read_file(options.recording, largest_recording));
    if (!result.difference.empty()) {
        throw input_error(options.recording + ": " + result.difference +
                          ": another coefficient file or another version");
    }
    if (options.as_json) {
        return cli::print_summary(io.out, {},
                                  {{"cycles", result.cycles}, {"duration_s", result.duration_s}},
                                  result.remarks);
    }
    for (const auto &remark : result.remarks) io.err << "compbox: " << remark << "\n";
    io.out << result.cycles << " cycles of " << result.duration_s
           << " s replayed: every output has the bits that the box wrote\n";
}

// Runs the scenario in its folder, or in a temporary one without -o, and prints its results.
void run_simulate(const simulate_options &options, const cli::streams &io) {
    if (!options.recording.empty()) return run_replay(options, io);
    if (options.plots && options.folder.empty()) {
        throw cli::usage_error("--plots", "needs a folder (-o)");
    }
    std::unique_ptr<temporary_folder> temporary;
    if (options.folder.empty()) temporary = std::make_unique<temporary_folder>();
    const simulation::simulate_outcome result = simulation::run_scenario(
        request_of(options, temporary ? temporary->path() : options.folder, io));
    show_progress("", io);
    for (const auto &warning : result.warnings) io.err << "compbox: " << warning << "\n";
    if (!options.as_json) io.out << result.text;
    std::vector<std::string> files;
    if (!temporary) files = write_results(options, result, io);
    if (options.as_json) cli::print_summary(io.out, files, result.report, result.warnings);
}

}  // namespace

void add_simulate(cli::command &app) {
    auto command =
        app.add_subcommand("simulate", "Measure, fit, compensate, remeasure in virtual time");
    const auto options = std::make_shared<simulate_options>();
    command
        .add_option("SCENARIO", options->scenario,
                    "Scenario file, see docs/report.md; with --replay the coefficient file")
        .required();
    command.add_option("--seeds N|A-B", options->seeds, "Machines to try: 7 or 1-20");
    command.add_option("--stats F.json", options->statistics,
                       "Statistics of a compboxd run, to go into the report");
    command.add_option("--log F.csv", options->log, "fakeplc's log of that run, likewise");
    command.add_flag("--plots", options->plots, "Figures too (FOLDER/plots/*.svg)");
    command.add_option("-o,--output DIR", options->folder,
                       "Folder for the report, measurements and coefficient files");
    command.add_option("--replay F.bin", options->recording,
                       "Step through what compboxd --record-inputs wrote; outputs must be the same "
                       "to the bit");
    cli::add_json(command, options->as_json);
    command.footer(
        R"(Measures a simulated machine as the scenario says, fits or trains its errors, and compensates it by
the box's own code. Then it remeasures the machine and prints the reduction of the true error. The
packages have scenarios in /usr/share/compbox/examples.

Example:
  compbox simulate examples/gantry-straightness/scenario.json -o out/gantry)");
    command.callback([options](const cli::streams &io) { run_simulate(*options, io); });
}

}  // namespace compbox
