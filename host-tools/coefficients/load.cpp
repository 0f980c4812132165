// SPDX-License-Identifier: MIT
#include "host-tools/coefficients/load.h"

#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/json.h"

extern "C" {
#include "firmware/config/config.h"
}

namespace compbox::coefficients {

namespace {

std::string counted(int count, const char *noun) {
    return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

}  // namespace

const cb_target any_target = {
    "the box",
    1u << CB_SOURCE_PLC | 1u << CB_SOURCE_CAN | 1u << CB_SOURCE_BUS | 1u << CB_SOURCE_HAND,
    1u << CB_TRANSPORT_TCP | 1u << CB_TRANSPORT_RTU, 0};
const cb_target stm32f405_target = {"the STM32F405", 1u << CB_SOURCE_PLC | 1u << CB_SOURCE_BUS,
                                    1u << CB_TRANSPORT_RTU, 0};

std::unique_ptr<cb_config> load_coefficient_text(const std::string &text, cb_message *message,
                                                 const cb_target &target) {
    auto config = std::make_unique<cb_config>();
    auto scratch = std::make_unique<cb_load_scratch>();
    const cb_error error =
        cb_config_load(config.get(), text.data(), text.size(), &target, scratch.get(), message);
    return error == CB_OK ? std::move(config) : nullptr;
}

std::unique_ptr<cb_config> load_coefficients(const std::string &path, std::string *text,
                                             const cb_target &target) {
    cb_message message = {};
    const std::string content = formats::read_file(path);
    auto config = load_coefficient_text(content, &message, target);
    if (text != nullptr) *text = content;
    if (config != nullptr) return config;
    const std::string remedy = formats::remedy_of_json(content);
    if (!remedy.empty() && message.line > 0)
        throw input_error(path, 0, 0, "is not a coefficient file{}", remedy);
    std::string sentence = message.text;
    if (sentence == "the key terms is missing") {
        sentence += " (of a machine file, make a coefficient file with compbox build)";
    }
    if (sentence == "the key format is missing" && content.find("\"terms\"") != std::string::npos) {
        sentence += " (of a term file, make a coefficient file with compbox build)";
    }
    if (message.line > 0) sentence += fmt::format(", line {}", message.line);
    if (message.line > 0 && message.column > 0) {
        sentence += fmt::format(", column {}", message.column);
    }
    throw input_error(path, 0, 0, sentence);
}

std::vector<memory_share> memory_of(const cb_config &config, std::size_t text_bytes) {
    return {{"text bytes", static_cast<unsigned>(text_bytes), CB_MAX_TEXT_BYTES},
            {"coefficients", config.pool_count, CB_POOL_FLOATS},
            {"inputs of terms", config.links_count, CB_MAX_LINKS},
            {"lags of banks", config.bank_lags_count, CB_MAX_BANK_LAGS}};
}

std::string memory_text(const cb_target &target, const std::vector<memory_share> &memory) {
    std::string text;
    for (const auto &one : memory) {
        text +=
            fmt::format("{}{} {} of {}", text.empty() ? "" : ", ", one.name, one.used, one.most);
    }
    return fmt::format("{} holds it: {}", target.name, text);
}

std::string summary(const cb_config &config) {
    return fmt::format("{}, {}, {}, coefficients {} of {}", counted(config.signals_count, "signal"),
                       counted(config.terms_count, "term"),
                       counted(config.channels_count, "channel"), config.pool_count,
                       CB_POOL_FLOATS);
}

}  // namespace compbox::coefficients
