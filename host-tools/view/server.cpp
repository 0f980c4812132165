// SPDX-License-Identifier: MIT
#include "host-tools/view/server.h"

#include <microhttpd.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <set>

#include "host-tools/formats/error.h"

namespace compbox::view {

namespace {

constexpr unsigned most_connections = 1200;  // and no more than descriptors
constexpr unsigned spare_descriptors = 32;   // for files
constexpr std::size_t most_streams = 100;
constexpr std::size_t connection_bytes = 8192;  // request line and headers; longer: 431
constexpr unsigned idle_s = 15, stream_idle_s = 30;

// Any socket address.
union socket_address {
    sockaddr_storage storage;
    sockaddr any;
};

// out: a listening socket. Throws input_error.
int listen_on(const listen_address &address) {
    addrinfo hints = {}, *found = nullptr;
    hints.ai_flags = AI_PASSIVE;
    hints.ai_socktype = SOCK_STREAM;
    const std::string port = std::to_string(address.port);
    const int fault = ::getaddrinfo(address.host.c_str(), port.c_str(), &hints, &found);
    if (fault != 0) throw input_error(address.host, 0, 0, std::string(::gai_strerror(fault)));
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> first(found, &::freeaddrinfo);
    const int one = 1;
    const int descriptor =
        ::socket(first->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (descriptor >= 0 &&
        ::setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one) == 0 &&
        ::bind(descriptor, first->ai_addr, first->ai_addrlen) == 0 &&
        ::listen(descriptor, 128) == 0) {
        return descriptor;
    }
    const int error = errno;
    if (descriptor >= 0) ::close(descriptor);
    throw input_error(address.host + ":" + port, 0, 0, "cannot listen there ({})",
                      std::strerror(error));
}

int port_of(int descriptor) {
    socket_address address = {};
    socklen_t size = sizeof address.storage;
    char port[NI_MAXSERV] = "0";
    if (::getsockname(descriptor, &address.any, &size) == 0) {
        ::getnameinfo(&address.any, size, nullptr, 0, port, sizeof port, NI_NUMERICSERV);
    }
    return std::stoi(port);
}

// Raises the limit of descriptors as far as it may. out: how many connections fit into it
unsigned connections_limit() {
    rlimit limit = {};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 100;
    const rlim_t wanted = most_connections + spare_descriptors;
    if (limit.rlim_cur < wanted) {
        limit.rlim_cur = std::min(limit.rlim_max, wanted);
        ::setrlimit(RLIMIT_NOFILE, &limit);
    }
    const rlim_t usable = std::max<rlim_t>(limit.rlim_cur, spare_descriptors + 1);
    return static_cast<unsigned>(std::min(usable, wanted)) - spare_descriptors;
}

std::optional<std::string> value_of(MHD_Connection *connection, MHD_ValueKind kind,
                                    const char *name) {
    const char *value = ::MHD_lookup_connection_value(connection, kind, name);
    return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

std::optional<login> login_of(MHD_Connection *connection) {
    char *password = nullptr;
    char *user = ::MHD_basic_auth_get_username_password(connection, &password);
    std::optional<login> by;
    if (user != nullptr && password != nullptr) by = login{user, password};
    ::MHD_free(user);
    ::MHD_free(password);
    return by;
}

// out: what one reader cannot change at will: an IPv4 address, or the first half of an IPv6 one
std::string address_of(MHD_Connection *connection) {
    const auto *info = ::MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
    if (info == nullptr) return "";
    const auto bytes = [](const auto &from, std::size_t size) {
        return std::string(reinterpret_cast<const char *>(&from), size);
    };
    if (info->client_addr->sa_family == AF_INET) {
        sockaddr_in four;
        std::memcpy(&four, info->client_addr, sizeof four);
        return bytes(four.sin_addr, sizeof four.sin_addr);
    }
    sockaddr_in6 six;
    std::memcpy(&six, info->client_addr, sizeof six);
    if (IN6_IS_ADDR_V4MAPPED(&six.sin6_addr)) return bytes(six.sin6_addr.s6_addr[12], 4);
    return bytes(six.sin6_addr, 8);
}

request request_of(MHD_Connection *connection, const char *path) {
    request to;
    to.path = path;
    to.host = value_of(connection, MHD_HEADER_KIND, "Host");
    to.accept = value_of(connection, MHD_HEADER_KIND, "Accept");
    to.if_none_match = value_of(connection, MHD_HEADER_KIND, "If-None-Match");
    to.by = login_of(connection);
    to.from = address_of(connection);
    to.steady_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    to.argument = [connection](const char *name) {
        return value_of(connection, MHD_GET_ARGUMENT_KIND, name);
    };
    return to;
}

void add_headers(MHD_Response *response, const answer &reply) {
    const auto add = [response](const char *name, const std::string &value) {
        ::MHD_add_response_header(response, name, value.c_str());
    };
    add("Content-Type", reply.type);
    add("Content-Security-Policy",
        "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
    add("X-Content-Type-Options", "nosniff");
    add("Referrer-Policy", "no-referrer");
    add("Cross-Origin-Resource-Policy", "same-origin");
    add("Cache-Control", reply.etag.empty() ? "no-store" : "no-cache");
    if (!reply.etag.empty()) add("ETag", std::string(reply.etag));
    if (reply.status == 401) add("WWW-Authenticate", "Basic realm=\"compbox\", charset=\"UTF-8\"");
    if (reply.status == 405) add("Allow", "GET, HEAD");
    if (reply.status == 429 || reply.status == 503) add("Retry-After", "10");
}

// out: a response that holds the body until it is sent
MHD_Response *response_of(const answer &reply) {
    // libmicrohttpd wants a pointer to what it may change, but does not change it.
    const auto bytes = [](const char *text) { return const_cast<char *>(text); };
    if (reply.text == nullptr) {
        return ::MHD_create_response_from_buffer(reply.fixed.size(), bytes(reply.fixed.data()),
                                                 MHD_RESPMEM_PERSISTENT);
    }
    const auto release = [](void *holder) { delete static_cast<body *>(holder); };
    return ::MHD_create_response_from_buffer_with_free_callback_cls(
        reply.text->size(), bytes(reply.text->data()), release, new body(reply.text));
}

}  // namespace

class server::connections {
  public:
    connections(const listen_address &address, site &from);
    ~connections();

    void wake();

    site &from_;
    std::string url_;
    MHD_Daemon *daemon_ = nullptr;

  private:
    // One reader of the feed, from its response to the end of its connection.
    struct stream {
        connections *of;
        MHD_Connection *connection;
        feed::reader place;
        bool is_suspended;
    };

    static MHD_Result take(void *self, MHD_Connection *connection, const char *path,
                           const char *method, const char *version, const char *data,
                           std::size_t *data_size, void **state);
    static ssize_t read(void *one, std::uint64_t position, char *bytes, std::size_t size);
    static void end(void *one);

    MHD_Result send(MHD_Connection *connection, const answer &reply);
    MHD_Response *start_stream(MHD_Connection *connection);

    std::set<stream *> streams_;
};

// Throws input_error if it cannot listen.
server::connections::connections(const listen_address &address, site &from) : from_(from) {
    const int descriptor = listen_on(address);
    const std::string host =
        address.host.find(':') == std::string::npos ? address.host : "[" + address.host + "]";
    url_ = fmt::format("http://{}:{}/", host, port_of(descriptor));
    const auto say_nothing = [](void *, const char *, va_list) {};
    daemon_ = ::MHD_start_daemon(
        MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME, 0, nullptr, nullptr, &connections::take, this,
        MHD_OPTION_EXTERNAL_LOGGER,
        static_cast<void (*)(void *, const char *, va_list)>(say_nothing), nullptr,
        MHD_OPTION_LISTEN_SOCKET, descriptor, MHD_OPTION_CONNECTION_LIMIT, connections_limit(),
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, connection_bytes, MHD_OPTION_CONNECTION_TIMEOUT, idle_s,
        MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_END);
    if (daemon_ != nullptr) return;
    ::close(descriptor);
    throw input_error(url_, 0, 0, "libmicrohttpd does not start");
}

server::connections::~connections() {
    for (stream *one : streams_) {
        if (one->is_suspended) ::MHD_resume_connection(one->connection);
        one->is_suspended = false;
    }
    ::MHD_stop_daemon(daemon_);
}

void server::connections::wake() {
    for (stream *one : streams_) {
        if (!one->is_suspended) continue;
        one->is_suspended = false;
        ::MHD_resume_connection(one->connection);
    }
    ::MHD_run(daemon_);
}

// A request comes in two calls: first its headers alone, then as a whole.
MHD_Result server::connections::take(void *self, MHD_Connection *connection, const char *path,
                                     const char *method, const char *, const char *,
                                     std::size_t *data_size, void **state) {
    auto *all = static_cast<connections *>(self);
    const bool reads = std::strcmp(method, "GET") == 0 || std::strcmp(method, "HEAD") == 0;
    if (!reads) {
        answer reply;
        reply.status = 405;
        reply.fixed = "This program answers GET and HEAD alone.\n";
        return all->send(connection, reply);
    }
    if (*state == nullptr) {
        *state = self;
        return MHD_YES;
    }
    if (*data_size != 0) return MHD_NO;  // a body where none belongs: closes the connection
    return all->send(connection,
                     all->from_.reply(request_of(connection, path), box_files::unix_now_s()));
}

MHD_Result server::connections::send(MHD_Connection *connection, const answer &reply) {
    answer checked = reply;
    if (reply.is_stream && streams_.size() >= most_streams) {
        checked = answer();
        checked.status = 503;
        checked.fixed = "Too many pages are open; try again later.\n";
    }
    MHD_Response *response = checked.is_stream ? start_stream(connection) : response_of(checked);
    if (response == nullptr) return MHD_NO;
    add_headers(response, checked);
    const MHD_Result result = ::MHD_queue_response(connection, checked.status, response);
    ::MHD_destroy_response(response);
    return result;
}

MHD_Response *server::connections::start_stream(MHD_Connection *connection) {
    ::MHD_set_connection_option(connection, MHD_CONNECTION_OPTION_TIMEOUT, stream_idle_s);
    auto *one = new stream{this, connection, from_.news().begin(), false};
    streams_.insert(one);
    MHD_Response *response = ::MHD_create_response_from_callback(
        MHD_SIZE_UNKNOWN, 4096, &connections::read, one, &connections::end);
    if (response == nullptr) end(one);
    return response;
}

// out: bytes for one reader; without any the connection sleeps until wake()
ssize_t server::connections::read(void *self, std::uint64_t, char *bytes, std::size_t size) {
    auto *one = static_cast<stream *>(self);
    const std::size_t got = one->of->from_.news().read(one->place, bytes, size);
    if (got == 0) {
        one->is_suspended = true;
        ::MHD_suspend_connection(one->connection);
    }
    return static_cast<ssize_t>(got);
}

void server::connections::end(void *self) {
    auto *one = static_cast<stream *>(self);
    one->of->streams_.erase(one);
    delete one;
}

server::server(const listen_address &address, site &from)
    : is_(std::make_unique<connections>(address, from)) {}

server::~server() = default;

std::string server::url() const {
    return is_->url_;
}

int server::descriptor() const {
    return ::MHD_get_daemon_info(is_->daemon_, MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd;
}

int server::timeout_ms(int most) const {
    MHD_UNSIGNED_LONG_LONG left = 0;
    if (::MHD_get_timeout(is_->daemon_, &left) != MHD_YES) return most;
    return static_cast<int>(std::min<MHD_UNSIGNED_LONG_LONG>(left, static_cast<unsigned>(most)));
}

void server::run() {
    ::MHD_run(is_->daemon_);
}

void server::wake() {
    is_->wake();
}

}  // namespace compbox::view
