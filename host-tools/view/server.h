// SPDX-License-Identifier: MIT
// HTTP by libmicrohttpd, without a thread of its own: the caller waits on descriptor() and calls
// run(). Connections, their memory and their idle time are limited; docs/view.md has the limits.
#pragma once

#include <memory>
#include <string>

#include "host-tools/view/access.h"
#include "host-tools/view/site.h"

namespace compbox::view {

class server {
  public:
    // Listens. in : site, which must live longer. Throws input_error if the address is not free.
    server(const listen_address &address, site &from);
    ~server();
    server(const server &) = delete;
    server &operator=(const server &) = delete;

    std::string url() const;  // "http://127.0.0.1:8090/", with the port that was free

    int descriptor() const;          // readable: call run()
    int timeout_ms(int most) const;  // call run() after this time even so
    void run();

    // Call it when the feed has something new: sends it to those that wait.
    void wake();

  private:
    class connections;
    std::unique_ptr<connections> is_;
};

}  // namespace compbox::view
