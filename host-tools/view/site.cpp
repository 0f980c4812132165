// SPDX-License-Identifier: MIT
#include "host-tools/view/site.h"

#include <fmt/core.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host-tools/view/page.h"

namespace compbox::view {

namespace {

// Of all replies that are being sent.
constexpr std::size_t most_body_bytes = 64u << 20;

// A sentence in place of what was asked for.
answer sentence(unsigned status, std::string_view text) {
    answer reply;
    reply.status = status;
    reply.fixed = text;
    return reply;
}

answer page_answer(const page_file &file, const request &to) {
    answer reply;
    reply.type = std::string(file.type);
    reply.etag = file.etag;
    reply.fixed = file.content;
    if (to.if_none_match == std::string(file.etag)) {
        reply.status = 304;
        reply.fixed = {};
    }
    return reply;
}

}  // namespace

site::site(const site_files &files, access_rule rule)
    : rule_(std::move(rule)), snapshot_(files.snapshot), bodies_(most_body_bytes) {}

// out: whether a new snapshot, or the reason why there is none, went to the feed
bool site::poll_snapshot(double unix_s) {
    const bool fresh = snapshot_.poll();
    const std::string why = snapshot_.why_not(unix_s);
    // An age in the sentence makes no new text.
    const bool ends = !why.empty() && last_why_.empty();
    if (fresh || ends || last_why_ == "-") feed_.set_live(snapshot_.live_text(unix_s));
    const json gone;
    if (fresh || !why.empty()) {
        recent_.add(unix_s, why.empty() ? snapshot_.value() : gone);
        recent_text_.reset();
    }
    const bool news = fresh || ends || last_why_ == "-";
    last_why_ = why;
    return news;
}

bool site::poll(double unix_s) {
    return poll_snapshot(unix_s);
}

answer site::json_answer(std::string text) {
    answer reply;
    reply.type = "application/json";
    reply.text = bodies_.keep(std::move(text));
    if (reply.text == nullptr) {
        return sentence(503, "Too many slow readers hold replies; try again later.\n");
    }
    return reply;
}

answer site::recent() {
    if (recent_text_ != nullptr) {
        answer reply = sentence(200, "");
        reply.type = "application/json";
        reply.text = recent_text_;
        return reply;
    }
    const answer reply = json_answer(columns_text(recent_.all()));
    recent_text_ = reply.text;
    return reply;
}

answer site::route(const request &to, double unix_s) {
    if (to.path == "/api/live") return json_answer(snapshot_.live_text(unix_s));
    if (to.path == "/api/recent") return recent();
    if (to.path == "/api/stream") {
        answer reply = sentence(200, "");
        reply.type = "text/event-stream";
        reply.is_stream = true;
        return reply;
    }
    if (const page_file *file = find_page(to.path)) return page_answer(*file, to);
    return sentence(404, "There is no such page.\n");
}

answer site::reply(const request &to, double unix_s) {
    if (!rule_.accepts_host(to.host)) {
        return sentence(421, "Use the address of this computer itself, such as 127.0.0.1.\n");
    }
    if (rule_.needs_login() && !(to.by && rule_.accepts_login(to.by->user, to.by->password))) {
        return sentence(401, "The user is compbox; the password is that of --password-file.\n");
    }
    return route(to, unix_s);
}

}  // namespace compbox::view
