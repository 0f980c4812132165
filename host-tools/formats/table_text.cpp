// SPDX-License-Identifier: MIT
#include "host-tools/formats/table_text.h"

#include "host-tools/formats/error.h"
#include "host-tools/formats/file.h"
#include "host-tools/formats/text.h"

namespace compbox::formats {

namespace {

constexpr const char *save_as_csv = "save it as CSV";

// Files that are no text, by their first bytes and by a text within the first kilobytes.
struct foreign_file {
    std::string start, within;
    const char *what, *remedy;
};

const foreign_file foreign_files[] = {
    {"PK\x03\x04", "xl/", "is a workbook of Excel (.xlsx)", save_as_csv},
    {"PK\x03\x04", "opendocument.spreadsheet", "is a workbook of LibreOffice (.ods)", save_as_csv},
    {"PK\x03\x04", "", "is a ZIP archive or a workbook", "unpack it, or save it as CSV"},
    {"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1", "", "is a workbook of an old Excel (.xls)", save_as_csv},
    {"<?xml", "Workbook", "is a workbook in XML", save_as_csv},
    {"<?xml", "", "is XML, not a table", save_as_csv},
    {"<!DOCTYPE", "", "is a page in HTML, not a table", save_as_csv},
    {"<html", "", "is a page in HTML, not a table", save_as_csv},
    {"{\\rtf", "", "is a document in RTF", "save it as plain text"},
    {"%PDF", "", "is a PDF", "export the readings as CSV or .rtl"},
    {"\x1F\x8B", "", "is compressed (gzip)", "unpack it first"},
    {"\x89PNG", "", "is a picture", "export the readings as CSV"},
    {"{", "", "is JSON, not a table in CSV", nullptr}};

// Throws input_error for a known kind of file that is no table in text.
void refuse_foreign(const std::string &path, const std::string &bytes) {
    constexpr std::size_t enough = 65536;
    const std::string head = bytes.substr(0, enough);
    for (const auto &one : foreign_files) {
        if (head.compare(0, one.start.size(), one.start) != 0) continue;
        if (head.find(one.within) == std::string::npos) continue;
        throw input_error(
            path, 0, 0,
            one.remedy == nullptr ? one.what : fmt::format("{}: {}", one.what, one.remedy));
    }
}

// out: the text with \n for \r\n and for a lone \r
std::string with_one_line_end(std::string text) {
    std::size_t to = 0;
    for (std::size_t from = 0; from < text.size(); ++from) {
        const bool pair = text[from] == '\r' && from + 1 < text.size() && text[from + 1] == '\n';
        if (pair) continue;
        text[to++] = text[from] == '\r' ? '\n' : text[from];
    }
    text.resize(to);
    return text;
}

}  // namespace

std::string read_table_text(const std::string &path) {
    const std::string bytes = read_file(path);
    refuse_foreign(path, bytes);
    return with_one_line_end(to_utf8(bytes));
}

}  // namespace compbox::formats
