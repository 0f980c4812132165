// SPDX-License-Identifier: MIT
#include "host-tools/uplink/broker.h"

#include <mosquitto.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>

#include "host-tools/formats/error.h"

namespace compbox::uplink {

namespace {

constexpr int keep_alive_s = 30, at_least_once = 1, wait_ms = 1000;
constexpr std::chrono::seconds first_pause{1}, longest_pause{30};  // between attempts to connect

std::string words_of(int result) {
    return result == MOSQ_ERR_ERRNO ? std::strerror(errno) : mosquitto_strerror(result);
}

}  // namespace

struct broker::inside {
    inside() { mosquitto_lib_init(); }
    ~inside() {
        if (client != nullptr) mosquitto_destroy(client);
        mosquitto_lib_cleanup();
    }
    inside(const inside &) = delete;
    inside &operator=(const inside &) = delete;

    broker_settings settings;
    mosquitto *client = nullptr;
    std::thread thread;       // connects, and runs the callbacks
    mutable std::mutex lock;  // of all below
    std::condition_variable stops;
    bool is_stopping = false;
    unsigned connections = 0;
    bool connected = false;
    std::string why_not;
    std::vector<int> confirmed;

    static inside &of(void *context) { return *static_cast<inside *>(context); }
    static void on_connect(mosquitto *, void *context, int result) {
        const std::lock_guard hold(of(context).lock);
        of(context).connected = result == 0;
        if (result == 0) ++of(context).connections;
        of(context).why_not = result == 0 ? "" : mosquitto_connack_string(result);
    }
    static void on_disconnect(mosquitto *, void *context, int result) {
        const std::lock_guard hold(of(context).lock);
        // Otherwise the broker has refused, and on_connect has the reason.
        if (of(context).connected) of(context).why_not = words_of(result);
        of(context).connected = false;
    }
    static void on_publish(mosquitto *, void *context, int id) {
        const std::lock_guard hold(of(context).lock);
        of(context).confirmed.push_back(id);
    }

    // Throws input_error with the library's words, as for a text that is no UTF-8.
    static void check(int result, const char *what) {
        if (result == MOSQ_ERR_SUCCESS) return;
        throw input_error(fmt::format("{} cannot be sent to a broker: {}", what, words_of(result)));
    }

    // Throws input_error for what cannot become right while the program runs.
    void prepare() const {
        const message &will = settings.will;
        if (!settings.user.empty())
            check(
                mosquitto_username_pw_set(client, settings.user.c_str(), settings.password.c_str()),
                "--mqtt-user");
        check(mosquitto_will_set(client, will.topic.c_str(), static_cast<int>(will.payload.size()),
                                 will.payload.data(), at_least_once, true),
              "--mqtt-topic");
        if (settings.ca_file.empty()) return;
        const int result =
            mosquitto_tls_set(client, settings.ca_file.c_str(), nullptr, nullptr, nullptr, nullptr);
        if (result != MOSQ_ERR_SUCCESS)
            throw input_error(settings.ca_file +
                              ": cannot be read as the certificate of an authority (PEM)");
    }

    // out: whether to run on: until there is no connection that could take what was sent last
    bool goes_on() const {
        const std::lock_guard hold(lock);
        return connected || !is_stopping;
    }

    unsigned connections_now() const {
        const std::lock_guard hold(lock);
        return connections;
    }

    // out: whether the broker shall end; waits for that at most this time
    bool stopping_within(std::chrono::seconds pause) {
        std::unique_lock hold(lock);
        return stops.wait_for(hold, pause, [&] { return is_stopping; });
    }

    // Connects again and again. The library's own loop ends for good at a name that cannot be
    // resolved and at a TLS handshake that fails. The pause begins anew behind a connection: that
    // an attempt has begun means nothing.
    void run() {
        auto pause = first_pause;
        for (;;) {
            const unsigned before = connections_now();
            int result =
                mosquitto_connect_async(client, settings.host.c_str(), settings.port, keep_alive_s);
            if (result != MOSQ_ERR_SUCCESS) {
                const std::string words = words_of(result);
                const std::lock_guard hold(lock);
                why_not = words;
            }
            while (result == MOSQ_ERR_SUCCESS && goes_on())
                result = mosquitto_loop(client, wait_ms, 1);
            if (connections_now() != before) pause = first_pause;
            if (stopping_within(pause)) return;
            pause = std::min(2 * pause, longest_pause);
        }
    }
};

broker::broker(const broker_settings &settings) : is_(std::make_unique<inside>()) {
    is_->settings = settings;
    is_->client = mosquitto_new(nullptr, true, is_.get());
    if (is_->client == nullptr) throw std::bad_alloc();
    mosquitto_connect_callback_set(is_->client, inside::on_connect);
    mosquitto_disconnect_callback_set(is_->client, inside::on_disconnect);
    mosquitto_publish_callback_set(is_->client, inside::on_publish);
    is_->prepare();
    mosquitto_threaded_set(is_->client, true);
    is_->thread = std::thread([inside = is_.get()] { inside->run(); });
}

broker::~broker() {
    {
        const std::lock_guard hold(is_->lock);
        is_->is_stopping = true;
    }
    is_->stops.notify_one();
    mosquitto_disconnect(is_->client);
    is_->thread.join();
}

unsigned broker::connection() const {
    const std::lock_guard hold(is_->lock);
    return is_->connected ? is_->connections : 0;
}

unsigned broker::connections() const {
    return is_->connections_now();
}

std::optional<int> broker::publish(const message &one, bool retained) {
    int id = 0;
    const int result =
        mosquitto_publish(is_->client, &id, one.topic.c_str(), static_cast<int>(one.payload.size()),
                          one.payload.data(), at_least_once, retained);
    if (result != MOSQ_ERR_SUCCESS) return std::nullopt;
    return id;
}

std::vector<int> broker::confirmed() {
    const std::lock_guard hold(is_->lock);
    return std::exchange(is_->confirmed, {});
}

std::string broker::why_not() const {
    const std::lock_guard hold(is_->lock);
    return is_->why_not;
}

}  // namespace compbox::uplink
