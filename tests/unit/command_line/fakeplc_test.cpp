// SPDX-License-Identifier: MIT
// The program fakeplc: its options, exit codes and log, with a client that is not ours.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>

#include "host-tools/fakeplc/server.h"
#include "host-tools/formats/csv.h"
#include "tests/support/paths.h"
#include "tests/support/temporary.h"

namespace compbox::cli {
namespace {

const std::string example = from_source("examples/gantry-straightness/");

// A running fakeplc whose stdin is closed; ended by SIGTERM.
struct fakeplc_process {
    pid_t pid = -1;
    std::string port;

    explicit fakeplc_process(std::vector<std::string> arguments) {
        int out[2];
        EXPECT_EQ(::pipe(out), 0);
        arguments.insert(arguments.begin(), built("fakeplc"));
        std::vector<char *> argv;
        for (auto &argument : arguments) argv.push_back(argument.data());
        argv.push_back(nullptr);
        pid = ::fork();
        if (pid == 0) {
            ::close(STDIN_FILENO);
            ::dup2(out[1], STDOUT_FILENO);
            ::execv(argv[0], argv.data());
            ::_exit(127);
        }
        ::close(out[1]);
        char line[256] = "";
        const ssize_t n = ::read(out[0], line, sizeof line - 1);
        ::close(out[0]);
        const std::string first(line, n > 0 ? static_cast<std::size_t>(n) : 0);
        EXPECT_EQ(first.rfind("fakeplc: listening on 127.0.0.1:", 0), 0u) << first;
        port = first.substr(first.rfind(':') + 1);
        port.erase(port.find_last_not_of('\n') + 1);
    }
    // The exit code after SIGTERM.
    int end() {
        int status = -1;
        ::kill(pid, SIGTERM);
        ::waitpid(pid, &status, 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
};

// Runs a command; its output, and its exit code in *code.
std::string output_of(const std::string &command, int *code) {
    std::string text;
    char block[512];
    FILE *pipe = ::popen((command + " 2>&1").c_str(), "r");
    while (const std::size_t n = std::fread(block, 1, sizeof block, pipe)) text.append(block, n);
    *code = WEXITSTATUS(::pclose(pipe));
    return text;
}

TEST(FakeplcProgram, ServesPymodbusAndEndsCleanlyOnSigterm) {
    const std::string log = compbox_test::temporary("program.csv");
    fakeplc_process plc({"--profile", "generic", "--listen", "127.0.0.1:0", "--machine",
                         example + "machine_twin.json", "--log", log});
    int code = -1;
    const std::string printed = output_of(
        "/usr/bin/python3 " + from_source("tests/unit/command_line/fakeplc_peer.py ") + plc.port,
        &code);
    EXPECT_EQ(code, 0) << printed;
    EXPECT_EQ(plc.end(), 0);
    const formats::csv_table table = formats::read_csv(log, {"event"});
    EXPECT_GT(table.rows.size(), 10u);
    EXPECT_GT(table.values("commanded_X_um").back(), 12.33);
}

TEST(FakeplcProgram, RefusesWithOneSentenceAndTheRightCode) {
    const fakeplc::modbus_server occupied("127.0.0.1:0", 1);
    const std::string fakeplc = built("fakeplc") + " ";
    const std::string map = "--map " + example + "machine.json ";
    const std::tuple<std::string, int, std::string> cases[] = {
        {"--dance", 2, ""},
        {"--profile plc5 " + map, 2, "plc5"},
        {map + "--listen here", 2, "is not HOST:PORT"},
        {map + "--listen " + occupied.address(), 1, "is in use"},
        {"--map missing.json --listen 127.0.0.1:0", 1, "missing.json: cannot open the file"},
        {map + "--listen 127.0.0.1:0 --log /nonexistent/l.csv", 1, "cannot create the log"},
        {"--help", 0, "Example:\n  fakeplc"},
    };
    for (const auto &[arguments, expected, words] : cases) {
        int code = -1;
        const std::string printed = output_of(fakeplc + arguments + " </dev/null", &code);
        EXPECT_EQ(code, expected) << arguments << "\n" << printed;
        EXPECT_NE(printed.find(words), std::string::npos) << arguments << "\n" << printed;
    }
}

}  // namespace
}  // namespace compbox::cli
