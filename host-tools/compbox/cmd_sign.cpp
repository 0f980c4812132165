// SPDX-License-Identifier: MIT
// compbox keygen, sign, verify: coefficient files that a box accepts from a network.
#include <filesystem>
#include <memory>
#include <ostream>

#include "host-tools/coefficients/load.h"
#include "host-tools/command_line/summary.h"
#include "host-tools/compbox/commands.h"
#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"
#include "host-tools/signing/signature.h"
#include "host-tools/signing/verify.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox {

namespace {

constexpr std::size_t most_key_bytes = 4096;

struct keygen_arguments {
    std::string name;
    bool as_json = false;
};

struct sign_arguments {
    std::string input, key, output;
    bool as_json = false;
};

struct verify_arguments {
    std::string input, keys;
    bool as_json = false;
};

// Throws input_error for a file that is there: boxes may know the key in it.
void refuse_existing(const std::string &path) {
    std::error_code error;
    if (std::filesystem::exists(std::filesystem::symlink_status(path, error))) {
        throw input_error(path, 0, 0, "exists, and a key is never written over; give another name");
    }
}

void run_keygen(const keygen_arguments &arguments, const cli::streams &io) {
    const std::string secret = arguments.name + ".key", published = arguments.name + ".pub";
    refuse_existing(secret);
    refuse_existing(published);
    const auto key = signing::secret_key::make();
    formats::write_secret_file(secret, key.text());
    formats::write_file(published, key.public_text());
    if (arguments.as_json) {
        return cli::print_summary(io.out, {secret, published}, {{"key", key.id()}});
    }
    io.out << fmt::format("key {}: keep {} secret, copy {} to the boxes\n", key.id(), secret,
                          published);
}

// Signs a file that the box's loader takes. Throws input_error.
void run_sign(const sign_arguments &arguments, const cli::streams &io) {
    const auto key = signing::secret_key::parse(arguments.key,
                                                formats::read_file(arguments.key, most_key_bytes));
    std::string text;
    const auto config = coefficients::load_coefficients(arguments.input, &text);
    const std::string comment = formats::printable(
        fmt::format("machine:{} revision:{}", config->machine, config->revision));
    const std::string output =
        arguments.output.empty() ? arguments.input + signing::suffix : arguments.output;
    formats::write_file(output, key.sign(text, comment), &io.out);
    if (arguments.as_json) {
        return cli::print_summary(
            io.out, {output},
            {{"key", key.id()}, {"machine", config->machine}, {"revision", config->revision}});
    }
    if (cli::on_stdout({output})) return;
    io.out << fmt::format("{} by key {}: {}\n", comment, key.id(), output);
}

// Throws input_error for a file that compboxd would refuse.
void run_verify(const verify_arguments &arguments, const cli::streams &io) {
    const std::string text = formats::read_file(arguments.input, CB_MAX_TEXT_BYTES);
    const std::string key = signing::signer_of(arguments.input, text, arguments.keys);
    if (arguments.as_json) return cli::print_summary(io.out, {}, {{"key", key}});
    io.out << fmt::format("{}: signed by {}\n", arguments.input, key);
}

void add_keygen(cli::command &app) {
    const auto arguments = std::make_shared<keygen_arguments>();
    cli::command keygen = app.add_subcommand("keygen", "Make a key to sign coefficient files");
    keygen.footer(
        R"(Writes NAME.key, which signs and which only you may read, and NAME.pub, which boxes verify with.
Neither has a password. A key that exists is never written over.

Example:
  compbox keygen plant)");
    keygen.add_option("NAME", arguments->name, "Name of both files, without .key and .pub")
        .required();
    cli::add_json(keygen, arguments->as_json);
    keygen.callback([arguments](const cli::streams &io) { run_keygen(*arguments, io); });
}

void add_verify(cli::command &app) {
    const auto arguments = std::make_shared<verify_arguments>();
    cli::command verify =
        app.add_subcommand("verify", "Check that an enrolled key has signed a coefficient file");
    verify.footer(
        R"(Judges FILE and FILE.minisig as compboxd --keys does, of which it is the same code. Exit code 1: refused.

Example:
  compbox verify coefficients.json --keys /etc/compbox/keys)");
    verify.add_option("COEFFICIENTS", arguments->input, "Coefficient file").required();
    verify.add_option("--keys DIR", arguments->keys, "Folder of public keys, NAME.pub").required();
    cli::add_json(verify, arguments->as_json);
    verify.callback([arguments](const cli::streams &io) { run_verify(*arguments, io); });
}

}  // namespace

void add_signing(cli::command &app) {
    add_keygen(app);
    const auto arguments = std::make_shared<sign_arguments>();
    cli::command sign = app.add_subcommand("sign", "Sign a coefficient file for boxes with keys");
    sign.footer(
        R"(Checks the file as the box does, and writes the signature beside it, in the format of minisign. The
signature names machine and revision for people. Sign last: any later change of the file needs a new signature.

Example:
  compbox sign coefficients.json --key plant.key)");
    sign.add_option("COEFFICIENTS", arguments->input, "Coefficient file").required();
    sign.add_option("--key F.key", arguments->key, "Secret key of compbox keygen or minisign -G -W")
        .required();
    sign.add_option("-o,--output F.minisig", arguments->output,
                    "Signature to write (COEFFICIENTS.minisig)");
    cli::add_json(sign, arguments->as_json);
    sign.callback([arguments](const cli::streams &io) { run_sign(*arguments, io); });
    add_verify(app);
}

}  // namespace compbox
