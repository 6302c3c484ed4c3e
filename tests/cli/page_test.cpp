// What one client can take of the page's server: memory, threads, and the end of the program.
// Records of a wrong type, which are named before a page shows anything.

#include "cli/page/page_server.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <future>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/page/viewed_files.hpp"
#include "palpate/files.hpp"
#include "support/sample_files.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::page_test {

using namespace std::chrono_literals;

constexpr std::size_t large = std::size_t{32} << 20;  ///< more than sockets hold in between
constexpr auto never = 1h;

/// A page whose buttons do nothing, and whose "/large" is large.
class Page {
 public:
  explicit Page(const cli::RequestLimits& limits = {}) {
    server_.emplace(
        cli::PageAddress{.port = 0},
        cli::PageAnswers{.get = [](const std::string& path) -> std::optional<std::string> {
                           return path == "/large" ? std::optional(std::string(large, '1'))
                                                   : std::nullopt;
                         },
                         .act = [](const nlohmann::json&) {}},
        limits);
  }
  int port() const {
    const std::string url = server_->url();
    return std::stoi(url.substr(url.rfind(':') + 1));
  }
  void end() { server_.reset(); }

 private:
  std::optional<cli::PageServer> server_;
};

class Client {
 public:
  explicit Client(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0)) {
    sockaddr_in address{.sin_family = AF_INET,
                        .sin_port = htons(static_cast<std::uint16_t>(port)),
                        .sin_addr = {htonl(INADDR_LOOPBACK)},
                        .sin_zero = {}};
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 &&
        errno != EINPROGRESS) {
      throw std::system_error(errno, std::generic_category(), "connect");
    }
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool ready(short event, std::chrono::milliseconds timeout = 20s) const {
    pollfd waits{socket_, event, 0};
    return ::poll(&waits, 1, static_cast<int>(timeout.count())) > 0;
  }
  /// False once the server has hung up.
  bool send(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t sent =
          ready(POLLOUT) ? ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) : -1;
      if (sent < 0) {
        return false;
      }
      text.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }
  /// At most so many bytes; none once the server has hung up.
  std::string read(std::size_t most) const {
    std::string text(most, '\0');
    const ssize_t got = ready(POLLIN) ? ::recv(socket_, text.data(), most, 0) : -1;
    text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return text;
  }
  /// What comes until the server hangs up.
  std::string read_all() const {
    std::string text;
    for (std::string more = read(65536); !more.empty(); more = read(65536)) {
      text += more;
    }
    return text;
  }

 private:
  int socket_;
};

std::string request(const std::string& line, const std::string& headers = "") {
  return line + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n";
}

/// What the page answers to requests until it hangs up, read after a pause.
std::string answer_to(const Page& page, const std::string& requests,
                      std::chrono::milliseconds pause = 0ms) {
  const Client client(page.port());
  client.send(requests);
  ::poll(nullptr, 0, static_cast<int>(pause.count()));
  return client.read_all();
}

TEST(PageServer, TakesNoRequestWithoutEnd) {
  const Page page;
  const std::string begin = "POST /do HTTP/1.1\r\nHost: localhost\r\n";
  const std::string filling(8000, 'v');
  for (const auto& [head, more] : {std::pair(begin, "X: " + filling + "\r\n"),
                                   {begin + "Transfer-Encoding: chunked\r\n\r\n",
                                    "2000\r\n" + std::string(0x2000, 'v') + "\r\n"},
                                   {request("GET /", "Content-Length: 99999999\r\n"), filling}}) {
    const Client client(page.port());
    EXPECT_TRUE(client.send(head));
    std::size_t sent = 0;
    while (sent < large && client.send(more)) {
      sent += more.size();
    }
    EXPECT_LT(sent, large) << head;
  }
}

TEST(PageServer, TakesSixteenKibibytesOfARequest) {
  const Page page;
  const std::string value(4000, 'v');
  const std::string headers = fmt::format("A: {0}\r\nB: {0}\r\nC: {0}\r\n", value) + "D: ";
  const std::size_t filled = request("GET /", headers + "\r\n").size();
  for (const auto& [length, status] : {std::pair(16384u, "200"), {16385u, "400"}}) {
    const std::string filling(length - filled, 'v');
    EXPECT_TRUE(answer_to(page, request("GET /", headers + filling + "\r\n"))
                    .starts_with(std::string("HTTP/1.1 ") + status));
  }
}

TEST(PageServer, WhoAsksNothingIsHungUpOn) {
  EXPECT_EQ(Client(Page({.reading = 10ms}).port()).read_all(), "");
}

TEST(PageServer, AnswersNoRanges) {
  std::string ranges = "Range: bytes=0-";
  for (int i = 1; i < 2650; ++i) {
    ranges += ",0-";
  }
  const std::string answer = answer_to(Page(), request("GET /page.js", ranges + "\r\n"));
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 ")) << answer.substr(0, 200);
  EXPECT_LT(answer.size(), 65536u);
}

// A page of another site may send any body to this server.
TEST(PageServer, TakesOneRequestOfAConnection) {
  const Page page;
  const std::string body = request("GET /a") + request("GET /b");
  const std::string length = fmt::format("Content-Length: {}\r\n", body.size());
  for (const std::string& head :
       {request("POST /do", "Origin: http://evil.example\r\n" + length), request("GET /", length),
        request("HEAD /", length), request("GET /", "Transfer-Encoding: chunked\r\n"),
        request("GET /"), std::string("nonsense\r\n\r\n")}) {
    // The last answer is the first.
    EXPECT_EQ(answer_to(page, head + body).rfind("HTTP/1.1 "), 0u) << head;
  }
}

TEST(PageServer, ARequestHasADeadline) {
  for (const char* head : {"GET / HTTP/1.1\r\nX: ",
                           "POST /do HTTP/1.1\r\nHost: localhost\r\n"
                           "Content-Length: 4000\r\n\r\n"}) {
    const Page page({.reading = 20ms});
    const Client client(page.port());
    ASSERT_TRUE(client.send(head));
    int bytes = 0;
    while (bytes < 3000 && client.send("v") && !client.ready(POLLIN, 1ms)) {
      ++bytes;
    }
    EXPECT_LT(bytes, 3000);
    client.read_all();  // ends
  }
}

TEST(PageServer, WhoReadsGetsTheWholeAnswerAndWhoReadsNothingIsHungUpOn) {
  const std::string of_large = request("GET /large");
  EXPECT_GT(answer_to(Page(), of_large).size(), large);
  const Page page({.writing = 10ms});
  std::size_t got = large;
  // Where the machine is busy, the server may notice later.
  for (auto pause = 20ms; got >= large && pause < 20s; pause *= 10) {
    got = answer_to(page, of_large, pause).size();
  }
  EXPECT_LT(got, large);
}

TEST(PageServer, TheEndWaitsForNobody) {
  Page page({.reading = never, .writing = never});
  const Client silent(page.port());
  const Client slow(page.port());
  ASSERT_TRUE(slow.send("GET / HTTP/1.1\r\nHost: "));
  const Client events(page.port());
  ASSERT_TRUE(events.send(request("GET /events")));
  const Client deaf(page.port());
  ASSERT_TRUE(deaf.send(request("GET /large")));
  ASSERT_TRUE(events.ready(POLLIN) && deaf.ready(POLLIN));
  std::future<void> ended = std::async(std::launch::async, [&] { page.end(); });
  ASSERT_EQ(ended.wait_for(20s), std::future_status::ready);
}

TEST(PageServer, EndsAsSoonAsItHasBegun) {
  for (int i = 0; i < 30; ++i) {
    Page().end();
  }
}

TEST(PageServer, AcceptsNoMoreConnectionsThanItHasRoomFor) {
  const Page page({.reading = never, .connections = 4});
  std::vector<std::unique_ptr<Client>> clients;
  const auto connects = [&] {
    clients.push_back(std::make_unique<Client>(page.port()));
    return clients.back()->ready(POLLOUT, 200ms);
  };
  while (clients.size() < 50 && connects()) {
  }
  EXPECT_LT(clients.size(), 50u);
  clients.clear();
  EXPECT_TRUE(answer_to(page, request("GET /")).starts_with("HTTP/1.1 200 "));
}

TEST(PageServer, AnAddressOfAnotherMachineIsNamed) {
  expect_named(
      input_error([&] { cli::PageServer({.host = "192.0.2.1", .port = 0}, {}); }),
      {"--page-address 192.0.2.1: no page can be served there", "such as 127.0.0.1, or 0.0.0.0"});
}

class ViewedFiles : public testing::Test {
 protected:
  /// A file of one record: E for certain, and these fields.
  std::string file_of(const std::string& fields) const {
    put_bytes(folder_ / "record.json",
              R"({"best": "E", "identity": {"E": 1.0}, )" + fields + "}\n");
    return folder_ / "record.json";
  }

  ScratchFolder folder_;
};

TEST_F(ViewedFiles, RecordingsTellTheirScaleAndTheirRows) {
  Recording recording = sample_training("A", 8);
  recording.pressure.assign(recording.pressure.size(), 3.0);
  std::fill_n(recording.pressure.begin(), 9, 50.0);  // of 288
  recording.pressure[0] = 1e38;
  write_recording(folder_ / "a.h5", recording);
  const cli::ViewedFiles files(std::vector{(folder_ / "a.h5").string()});
  EXPECT_NEAR(nlohmann::json::parse(files.get("/file/0").value())["largest"], 50.0, 2.0);
  EXPECT_EQ(nlohmann::json::parse(files.get("/file/0/rows/7").value())["pose"].size(), 1u);
  for (const char* none : {"/file/0/rows/8", "/file/0/rows/-1", "/file/0/rows/x", "/file/0/rows",
                           "/file/1", "/file/-1", "/file/", "/page/0", "file"}) {
    EXPECT_FALSE(files.get(none)) << none;
  }
}

TEST_F(ViewedFiles, FieldsOfAWrongTypeAreNamed) {
  const std::pair<const char*, const char*> cases[] = {
      {R"("recording": 7)", "field 'recording' is 7, not a name"},
      {R"("touches": "x")", "field 'touches' is string, not a whole number from 0"},
      {R"("touches": -1)", "field 'touches' is -1, not a whole number from 0"},
      {R"("touches": 1e300)", "field 'touches' is 1e+300, not a whole number from 0"},
      {R"("touches": 1000000001)", "field 'touches' is 1000000001, not"},
      {R"("error": 5)", "field 'error' is 5, not a sentence"},
      {R"("unknown": "x", "touch": 0)", "field 'unknown' is string, not a whole number"},
      {R"("unknown": 0, "touch": 0.5)", "field 'touch' is 0.5, not a whole number"},
      {R"("mode": 3)", "field 'mode' is 3, not an object"},
      {R"("mode": {"map": 5})", "field 'mode.map' is 5, not a file"},
      {R"("mode": {"map": "E.h5", "mirrored": "no"})", "field 'mode.mirrored' is string, not true"},
      {R"("fit": {"verdict": {}})", "field 'fit.verdict' is object, not a word"},
      {R"("decision": {"act": "yes"})", "field 'decision.act' is string, not true or false"},
  };
  for (const auto& [fields, words] : cases) {
    const std::string path = file_of(fields);
    const std::string said = input_error([&] { cli::ViewedFiles(std::vector{path}); });
    EXPECT_TRUE(said.starts_with(path + ": record 0: " + words)) << said;
  }
}

TEST_F(ViewedFiles, FieldsThatAreNullAreMissing) {
  const std::string path = file_of(
      R"("recording": null, "touches": null, "error": null, "unknown": null, "touch": 0,
         "mode": {"map": null, "mirrored": null}, "fit": null, "decision": {"act": null})");
  const cli::ViewedFiles files(std::vector{path});
  EXPECT_EQ(files.get("/file/0"),
            R"({"kind":"records","rows":[["",0,"E",1.0,null,null,null,null]]})"
            "\n");
  EXPECT_TRUE(files.get("/file/0/record/0"));
  EXPECT_FALSE(files.get("/file/0/map/0"));
}

TEST_F(ViewedFiles, RecordsNestWithinReason) {
  const auto nested = [](std::size_t levels) {
    return R"("x": )" + std::string(levels, '[') + std::string(levels, ']');
  };
  EXPECT_TRUE(cli::ViewedFiles(std::vector{file_of(nested(62))}).get("/file/0/record/0"));
  for (const std::size_t levels : {65, 200'000}) {
    const std::string path = file_of(nested(levels));
    expect_named(input_error([&] { cli::ViewedFiles(std::vector{path}); }),
                 {"record 0 is nested more than 64 deep"});
  }
}

}  // namespace palpate::page_test
