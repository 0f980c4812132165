// SPDX-License-Identifier: MIT
#include "host-tools/uplink/broker.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>

#include "host-tools/formats/error.h"

namespace compbox::uplink {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// A listening socket on this computer, at any free port.
class listener {
  public:
    explicit listener(int backlog) : descriptor_(::socket(AF_INET, SOCK_STREAM, 0)) {
        at_.sin_family = AF_INET;
        at_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof at_;
        EXPECT_EQ(::bind(descriptor_, address(), size), 0);
        EXPECT_EQ(::listen(descriptor_, backlog), 0);
        EXPECT_EQ(::getsockname(descriptor_, reinterpret_cast<sockaddr *>(&at_), &size), 0);
    }
    ~listener() { ::close(descriptor_); }

    int descriptor() const { return descriptor_; }
    const sockaddr *address() const { return reinterpret_cast<const sockaddr *>(&at_); }
    broker_settings settings() const {
        broker_settings made;
        made.host = "127.0.0.1";
        made.port = ntohs(at_.sin_port);
        made.will = {"box/online", "0"};
        return made;
    }

  private:
    int descriptor_;
    sockaddr_in at_ = {};
};

// As with a wrong password: the second pause between the attempts is longer than the first.
TEST(broker, does_not_knock_each_second_where_it_is_refused) {
    const listener door(8);
    const broker one(door.settings());
    steady_clock::time_point refused_at[3];
    for (int knock = 0; knock < 3; ++knock) {
        const int connection = ::accept(door.descriptor(), nullptr, nullptr);
        if (knock == 2) {
            EXPECT_GE(steady_clock::now() - refused_at[1], milliseconds(1900));
        }
        char bytes[1000];
        EXPECT_GT(::recv(connection, bytes, sizeof bytes, 0), 0);
        refused_at[knock] = steady_clock::now();
        const unsigned char refused[] = {0x20, 2, 0, 5};  // CONNACK, not authorised
        EXPECT_EQ(::send(connection, refused, sizeof refused, MSG_NOSIGNAL), 4);
        ::close(connection);
    }
    EXPECT_NE(one.why_not().find("not authorised"), std::string::npos) << one.why_not();
}

TEST(broker, refuses_texts_that_no_broker_takes) {
    broker_settings topic;
    topic.will = {"plant/\xFF/online", "0"};
    EXPECT_THROW(broker{topic}, input_error);
    topic.will.topic = "plant/+/online";
    EXPECT_THROW(broker{topic}, input_error);
    broker_settings user;
    user.will = {"box/online", "0"};
    user.user = "M\xFCller";  // Latin-1
    EXPECT_THROW(broker{user}, input_error);
}

}  // namespace
}  // namespace compbox::uplink
