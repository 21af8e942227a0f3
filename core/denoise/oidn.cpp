#include "core/denoise/oidn.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <vector>

#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/cgroup.h"
#include "core/denoise/oidn_protocol.h"

namespace core {
namespace {

using Clock = std::chrono::steady_clock;

/// Lower priority than the server's threads, so that rendering and requests come first.
constexpr int kNiceness = 5;
constexpr std::size_t kTextMost = 4096;

/// why: may come from the library; it also becomes part of HTTP headers.
Error failed(std::string why) {
  std::replace_if(
      why.begin(), why.end(), [](char c) { return c < ' ' || c > '~'; }, ' ');
  return Error{ErrorCode::kUnavailable, "Open Image Denoise: " + why, ""};
}

/// A running helper process, killed by the destructor.
class Helper {
 public:
  /// Returns null if it cannot be started.
  static std::unique_ptr<Helper> start(const OidnOptions& options) {
    int ends[2] = {-1, -1};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
      return nullptr;
    }
    // Before the fork: the child of a multithreaded process may only call async-signal-safe
    // functions.
    std::string verb = "denoise";
    std::string program = options.program;
    std::string folder = options.folder;
    char* arguments[] = {program.data(), verb.data(), folder.data(), nullptr};
    const pid_t child = ::fork();
    if (child == 0) {
      if (::dup2(ends[1], 0) == 0 && ::dup2(ends[1], 1) == 1) {
        ::close_range(3, ~0U, 0);
        ::setpriority(PRIO_PROCESS, 0, kNiceness);
        ::execv(program.c_str(), arguments);
      }
      ::_exit(127);
    }
    ::close(ends[1]);
    if (child < 0) {
      ::close(ends[0]);
      return nullptr;
    }
    return std::unique_ptr<Helper>(new Helper(child, ends[0]));
  }
  ~Helper() {
    ::close(socket_);
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }
  Helper(const Helper&) = delete;
  Helper& operator=(const Helper&) = delete;

  /// Sends or receives all bytes. Returns false if the helper has ended or the time is up.
  bool send(const void* from, std::size_t bytes, Clock::time_point until) const {
    return transfer(POLLOUT, bytes, until, [&](std::size_t at, std::size_t left) {
      return ::send(socket_, static_cast<const char*>(from) + at, left,
                    MSG_NOSIGNAL | MSG_DONTWAIT);
    });
  }
  bool receive(void* to, std::size_t bytes, Clock::time_point until) const {
    return transfer(POLLIN, bytes, until, [&](std::size_t at, std::size_t left) {
      return ::recv(socket_, static_cast<char*>(to) + at, left, MSG_DONTWAIT);
    });
  }

 private:
  Helper(pid_t child, int socket) : child_(child), socket_(socket) {}

  template <typename Some>
  bool transfer(short event, std::size_t bytes, Clock::time_point until, const Some& some) const {
    std::size_t done = 0;
    while (done < bytes) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
      pollfd wait = {.fd = socket_, .events = event, .revents = 0};
      if (left <= 0 || ::poll(&wait, 1, static_cast<int>(left)) == 0) {
        return false;
      }
      const ssize_t count = some(done, bytes - done);
      if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) {
        return false;
      }
      done += static_cast<std::size_t>(std::max<ssize_t>(count, 0));
    }
    return true;
  }

  pid_t child_;
  int socket_;
};

std::vector<float> interleaved(const ColorPlanes& planes) {
  std::vector<float> out(3 * planes[0].size());
  for (std::size_t i = 0; i < planes[0].size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      out[3 * i + c] = planes[c][i];
    }
  }
  return out;
}

std::string version_text(std::uint32_t version) {
  return std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
         std::to_string(version % 100);
}

bool has_library(const std::filesystem::path& folder) {
  std::error_code none;
  return std::filesystem::exists(folder / "libOpenImageDenoise.so.2", none);
}

}  // namespace

std::string find_oidn() {
  if (const char* named = std::getenv("TESSERA_OIDN"); named != nullptr && *named != '\0') {
    const std::filesystem::path within = std::filesystem::path(named) / "lib";
    return has_library(within) ? within.string() : named;
  }
  std::error_code none;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", none);
  for (const char* beside : {"oidn/lib", "../lib/tessera/oidn/lib"}) {
    const auto folder = (self.parent_path() / beside).lexically_normal();
    if (has_library(folder)) {
      return folder.string();
    }
  }
  return "";
}

Result<FilteredHalves> OidnDenoiser::denoise(std::span<const HalfPicture> halves,
                                             const FeaturePicture* features,
                                             const ParallelFor& /*parallel*/) const {
  if (options_.folder.empty()) {
    return failed("its library was not found; set TESSERA_OIDN to its folder");
  }
  const auto helper = Helper::start(options_);
  if (helper == nullptr) {
    return failed("cannot start its process");
  }
  OidnRequest request;
  request.width = static_cast<std::uint32_t>(halves[0].width);
  request.height = static_cast<std::uint32_t>(halves[0].height);
  request.pictures = static_cast<std::uint32_t>(halves.size());
  request.has_features = features != nullptr ? 1 : 0;
  request.threads = static_cast<unsigned>(usable_threads());
  const double millions = 1e-6 * static_cast<double>(halves[0].variance.size());
  const Clock::time_point until = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                                     options_.patience * (1 + millions));
  bool sent = helper->send(&request, sizeof(request), until);
  const auto send = [&](const ColorPlanes& planes) {
    const std::vector<float> all = interleaved(planes);
    sent = sent && helper->send(all.data(), all.size() * sizeof(float), until);
  };
  for (const HalfPicture& half : halves) {
    send(half.mean);
  }
  if (features != nullptr) {
    send(features->albedo);
    send(features->normal);
  }
  OidnAnswer answer;
  if (!sent || !helper->receive(&answer, sizeof(answer), until)) {
    return failed(Clock::now() >= until ? "it took too long and was stopped"
                                        : "its process ended without a result");
  }
  if (answer.text_bytes > 0) {
    std::string text(std::min<std::size_t>(answer.text_bytes, kTextMost), '\0');
    return failed(helper->receive(text.data(), text.size(), until) ? text : "it failed");
  }
  FilteredHalves out;
  out.planes.resize(halves.size());
  std::vector<float> all(3 * halves[0].variance.size());
  for (ColorPlanes& planes : out.planes) {
    if (!helper->receive(all.data(), all.size() * sizeof(float), until)) {
      return failed("its process ended without a result");
    }
    planes.fill(Plane(all.size() / 3));
    for (std::size_t i = 0; i < all.size(); ++i) {
      planes[i % 3][i / 3] = all[i];
    }
  }
  out.by = {"oidn", version_text(answer.version), std::string(answer.sha256, sizeof(answer.sha256)),
            "balanced"};
  return out;
}

}  // namespace core
