// SPDX-License-Identifier: MIT
// stage: compboxd on the simulated computer, driven over stdin and stdout by the tests in
// tests/daemon. A line is a JSON array, a command and its arguments; it is answered by a line, an
// object with the world's time `now` in ns. Time passes in the command `run` alone, which returns
// at the first event: bytes, connections, the end of the process. Bytes are hexadecimal.
#include <iostream>
#include <optional>
#include <string>

#include "tests/world/stage/stage.h"

// in : a seed, for clocks, latencies and the duration of calls. out: 0 at the end of the input, 2
// for wrong usage
int main(int argc, char **argv) {
    if (argc != 2) {
        std::cerr << "usage: stage SEED\n";
        return 2;
    }
    compbox::world::stage stage(std::stoull(argv[1]));
    for (std::string line; std::getline(std::cin, line);)
        std::cout << stage.obey(line) << std::endl;
    return 0;
}
