// SPDX-License-Identifier: MIT
#include "host-tools/view/site.h"

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host-tools/view/metrics.h"
#include "host-tools/view/page.h"

namespace compbox::view {

namespace {

// Of all replies that are being sent.
constexpr std::size_t most_body_bytes = 64u << 20;

// Of the curves of the last hours: kept for some seconds, for so many numbers of hours.
constexpr double texts_last_s = 5.0;
constexpr std::size_t most_texts = 8;

// A sentence in place of what was asked for.
answer sentence(unsigned status, std::string_view text) {
    answer reply;
    reply.status = status;
    reply.fixed = text;
    return reply;
}

// out: an argument that is a whole number, or `otherwise` if it is missing; nothing: no such number
std::optional<long> whole_argument(const request &to, const char *name, long otherwise, long least,
                                   long most) {
    const auto text = to.argument(name);
    if (!text) return otherwise;
    long number = 0;
    const char *end = text->data() + text->size();
    const auto read = std::from_chars(text->data(), end, number);
    if (read.ec != std::errc() || read.ptr != end || number < least || number > most) {
        return std::nullopt;
    }
    return number;
}

answer kept_json(const body &text) {
    answer reply;
    reply.type = "application/json";
    reply.text = text;
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
    : rule_(std::move(rule)),
      snapshot_(files.snapshot),
      events_(files.events),
      record_(files.record),
      bodies_(most_body_bytes) {}

// out: whether a new snapshot, or the reason why there is none, went to the feed
bool site::poll_snapshot(double unix_s) {
    const bool fresh = snapshot_.poll();
    const std::string why = snapshot_.why_not(unix_s);
    // An age in the sentence makes no new text.
    const bool ends = !why.empty() && last_why_.empty();
    const bool news = fresh || ends || last_why_ == "-";
    if (news) feed_.set_live(snapshot_.live_text(unix_s));
    const json gone;
    if (fresh || !why.empty()) {
        recent_.add(unix_s, why.empty() ? snapshot_.value() : gone);
        recent_text_.reset();
    }
    last_why_ = why;
    return news;
}

// out: whether new events went to the feed
bool site::poll_events() {
    bool news = false;
    events_.poll([&](const std::string &event) {
        feed_.add_event(event);
        if (on_event) on_event(event);
        news = true;
    });
    return news;
}

bool site::poll(double unix_s) {
    const bool live = poll_snapshot(unix_s);
    record_.poll(unix_s);
    return poll_events() || live;
}

answer site::json_answer(std::string text) {
    const body kept = bodies_.keep(std::move(text));
    if (kept != nullptr) return kept_json(kept);
    return sentence(503, "Too many slow readers hold replies; try again later.\n");
}

answer site::recent() {
    if (recent_text_ != nullptr) return kept_json(recent_text_);
    const answer reply = json_answer(columns_text(recent_.all()));
    recent_text_ = reply.text;
    return reply;
}

answer site::events(const request &to) {
    const auto limit = whole_argument(to, "limit", 200, 1, box_files::event_log_lines);
    if (!limit) return sentence(400, "limit is a whole number, 1 to 1000.\n");
    return json_answer(events_.text(static_cast<std::size_t>(*limit)));
}

// Makes a text anew only when the one before is some seconds old.
answer site::history(const request &to, double unix_s) {
    const auto hours = whole_argument(to, "hours", 24, 1, history_most_hours);
    if (!hours) return sentence(400, "hours is a whole number, 1 to 744.\n");
    auto made = history_texts_.find(*hours);
    if (made != history_texts_.end() && std::abs(unix_s - made->second.unix_s) < texts_last_s) {
        return kept_json(made->second.text);
    }
    std::set<std::string> terms;
    if (snapshot_.value().is_object()) {
        for (const auto &one : snapshot_.value().at("terms")) terms.insert(one.at("name"));
    }
    const auto table = record_.values().last(static_cast<unsigned>(*hours), unix_s, terms);
    const answer reply = json_answer(columns_text(table));
    if (history_texts_.size() >= most_texts) history_texts_.clear();
    if (reply.text != nullptr) history_texts_[*hours] = {unix_s, reply.text};
    return reply;
}

answer site::metrics(const request &to, double unix_s) {
    const metrics_format format = metrics_format_of(to.accept.value_or(""));
    const auto figures = plant ? std::optional(plant()) : std::nullopt;
    answer reply = json_answer(metrics_text(snapshot_, figures, unix_s, format));
    if (reply.text != nullptr) reply.type = metrics_type(format);
    return reply;
}

answer site::route(const request &to, double unix_s) {
    if (to.path == "/api/live") return json_answer(snapshot_.live_text(unix_s));
    if (to.path == "/api/recent") return recent();
    if (to.path == "/api/history") return history(to, unix_s);
    if (to.path == "/api/events") return events(to);
    if (to.path == "/metrics") return metrics(to, unix_s);
    if (to.path == "/api/stream") {
        answer reply = sentence(200, "");
        reply.type = "text/event-stream";
        reply.is_stream = true;
        return reply;
    }
    if (const page_file *file = find_page(to.path)) return page_answer(*file, to);
    return sentence(404, "There is no such page.\n");
}

// out: 0: the reader may read; 401 or 429
unsigned site::refusal(const request &to) {
    if (!rule_.needs_login()) return 0;
    if (!to.by) return 401;
    if (!guesses_.may_try(to.from, to.steady_s)) return 429;
    if (rule_.accepts_login(to.by->user, to.by->password)) return 0;
    guesses_.was_wrong(to.from, to.steady_s);
    return 401;
}

answer site::reply(const request &to, double unix_s) {
    if (!rule_.accepts_host(to.host)) {
        return sentence(421, "Use the address of this computer itself, such as 127.0.0.1.\n");
    }
    if (const unsigned status = refusal(to); status != 0) {
        return sentence(
            status, status == 401
                        ? "The user is compbox; the password is that of --password-file.\n"
                        : "Too many wrong passwords came from this address; try again later.\n");
    }
    return route(to, unix_s);
}

}  // namespace compbox::view
