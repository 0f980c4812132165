// SPDX-License-Identifier: MIT
#include "host-tools/formats/plot.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>

#include "host-tools/formats/csv.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"

extern char **environ;

namespace compbox::formats {

namespace {

// A temporary file with a unique name; its owner removes it.
class temporary_file {
  public:
    explicit temporary_file(const std::string &stem, const std::string &suffix = "") {
        name_ = fmt::format("{}-XXXXXX{}", stem, suffix);
        const int fd = ::mkostemps(name_.data(), static_cast<int>(suffix.size()), O_CLOEXEC);
        if (fd < 0) throw input_error(stem, 0, 0, "cannot create a temporary file there");
        ::close(fd);
    }
    ~temporary_file() { ::unlink(name_.c_str()); }
    temporary_file(const temporary_file &) = delete;
    temporary_file &operator=(const temporary_file &) = delete;
    const std::string &name() const { return name_; }

  private:
    std::string name_;
};

std::string suffix_of(const std::string &path) {
    std::string suffix = std::filesystem::path(path).extension().string();
    for (char &c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return suffix;
}

// out: the `set terminal` line for a suffix
std::string terminal_of(const std::string &path, int width, int height) {
    const std::string suffix = suffix_of(path);
    if (suffix == ".svg") {
        return fmt::format(
            "set terminal svg size {},{} dynamic background '#ffffff' font "
            "'Helvetica,13' noenhanced\n",
            width, height);
    }
    if (suffix == ".png") {
        return fmt::format("set terminal pngcairo size {},{} font 'Helvetica,11' noenhanced\n",
                           width, height);
    }
    if (suffix == ".pdf") {
        return fmt::format("set terminal pdfcairo size {}in,{}in font 'Helvetica,10' noenhanced\n",
                           width / 100.0, height / 100.0);
    }
    throw input_error(path, 0, 0, "a figure is written as .svg, .png or .pdf; give it such a name");
}

// gnuplot does not report a full disk, so the end of the figure is checked by its format.
bool is_whole(const std::string &picture, const std::string &suffix) {
    const std::string end = suffix == ".svg" ? "</svg>" : suffix == ".png" ? "IEND" : "%%EOF";
    constexpr std::size_t behind = 16;  // line end, check sum
    const std::string bytes = read_file(picture);
    const std::size_t found = bytes.rfind(end);
    return found != std::string::npos && bytes.size() - found - end.size() <= behind;
}

std::string first_line(const std::string &text) {
    std::size_t start = text.find_first_not_of(" \t\r\n");
    if (start == std::string::npos) return "no reason given";
    return text.substr(start, text.find('\n', start) - start);
}

// Runs `gnuplot script`, messages into the file `messages`. Returns its exit code, or -errno when
// it could not be started.
int spawn_gnuplot(const std::string &script, const std::string &messages) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, messages.c_str(), O_WRONLY | O_TRUNC,
                                     0600);
    std::string program = "gnuplot", argument = script;
    char *arguments[] = {program.data(), argument.data(), nullptr};
    pid_t child = -1;
    const int refused = ::posix_spawnp(&child, "gnuplot", &actions, nullptr, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    if (refused != 0) return -refused;
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

std::string plot_data(const std::string &name, const std::vector<std::vector<double>> &columns) {
    std::string text = fmt::format("${} << EOD\n", name);
    const std::size_t rows = columns.empty() ? 0 : columns.front().size();
    for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t c = 0; c < columns.size(); ++c) {
            const double value = columns[c].at(r);
            text += fmt::format("{}{}", c ? " " : "",
                                std::isfinite(value) ? fmt::format("{}", value) : "NaN");
        }
        text += '\n';
    }
    return text + "EOD\n";
}

std::string plot_text(const std::string &text) {
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? "''" : std::string(1, c == '\n' ? ' ' : c);
    return quoted + "'";
}

namespace {

// Draws into the file `picture`, whose suffix chooses the terminal; messages name `path`.
// Throws input_error as run_gnuplot does.
void draw(const std::string &path, const std::string &picture, const std::string &script, int width,
          int height) {
    const std::string terminal = terminal_of(path, width, height);
    const std::string folder = std::filesystem::temp_directory_path().string();
    const temporary_file program(folder + "/compbox-plot", ".gp");
    const temporary_file messages(folder + "/compbox-plot", ".log");
    std::ofstream(program.name()) << "set encoding utf8\n"
                                  << terminal << "set output " << plot_text(picture) << "\n"
                                  << script << "\nunset output\n";
    const int code = spawn_gnuplot(program.name(), messages.name());
    if (code == -ENOENT || code == 127) {
        throw input_error(
            path, 0, 0,
            "no figure without gnuplot: install it (apt install gnuplot-nox) or leave "
            "the figure out");
    }
    if (code != 0) {
        throw input_error(path, 0, 0, "gnuplot could not draw the figure ({})",
                          first_line(read_file(messages.name())));
    }
    if (!is_whole(picture, suffix_of(path))) {
        throw input_error(path, 0, 0, "the figure could not be written whole (is the disk full?)");
    }
}

}  // namespace

void run_gnuplot(const std::string &path, const std::string &script, int width, int height) {
    refuse_outside(path);
    refuse_given(path, "the figure");
    terminal_of(path, width, height);  // refuses the name before it makes a file
    const temporary_file picture(path + ".tmp", suffix_of(path));
    draw(path, picture.name(), script, width, height);
    ::chmod(picture.name().c_str(), 0644);
    if (::rename(picture.name().c_str(), path.c_str()) != 0) {
        throw input_error(path, 0, 0, "cannot write the figure there");
    }
}

std::string gnuplot_svg(const std::string &script, int width, int height) {
    const std::string folder = std::filesystem::temp_directory_path().string();
    const temporary_file picture(folder + "/compbox-plot", ".svg");
    draw(picture.name(), picture.name(), script, width, height);
    const std::string text = read_file(picture.name());
    return std::regex_replace(text.substr(text.find("<svg")), std::regex(" +\n"), "\n");
}

}  // namespace compbox::formats
