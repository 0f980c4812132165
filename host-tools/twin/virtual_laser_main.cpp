// SPDX-License-Identifier: MIT
// virtual-laser: measures the twin as a laser interferometer would, and writes only that.
#include <optional>
#include <ostream>

#include "host-tools/command_line/command_line.h"
#include "host-tools/twin/laser.h"

// out: exit code 0 done, 1 a file is bad, 2 wrong usage, 70 a fault of the program
int main(int argc, char **argv) {
    const auto io = compbox::cli::standard_streams();
    compbox::cli::program app{"virtual-laser: measures the axes of a simulated machine", io};
    app.set_version_flag("--version", "virtual-laser " CB_VERSION);
    app.footer(
        "Writes DIR/EZX.csv … (position_mm,error_um,run), one file for each error of the twin.\n\n"
        "Example:\n"
        "  virtual-laser --machine machine_twin.json --seed 7 -o measurements");
    std::string machine, folder;
    std::optional<std::uint64_t> seed;
    app.add_option("--machine TWIN.json", machine, "The twin file").required();
    app.add_option("--seed K", seed,
                   "Another machine of the same kind (instead of the file's seed)");
    app.add_option("-o DIR", folder, "Folder for the measurements, made where missing").required();
    return app.run(argc, argv, [&] {
        compbox::twin::twin_config config = compbox::twin::load_twin(machine);
        if (seed) config.seed = *seed;
        for (const auto &path :
             compbox::twin::measure_all(compbox::twin::twin_machine(config), folder)) {
            io.out << path << "\n";
        }
    });
}
