#include "core/scene_io/convert.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/base/descriptor.h"
#include "core/base/temporary_folder.h"
#include "core/base/text.h"
#include "core/scene_io/convert_protocol.h"
#include "core/scene_io/gltf_json.h"
#include "core/scene_io/system_calls.h"

namespace core {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::array<std::string_view, 4> kOwn = {"3mf", "obj", "ply", "stl"};
constexpr std::size_t kTextMost = 16384;  ///< of what a converter says
constexpr int kNiceness = 5;              ///< as of the denoiser's helper

/// Sockets of any kind but local ones fail with EACCES, also those of processes that it starts.
constexpr std::array<sock_filter, 9> kNoNetwork = {{
    BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)),
    BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kSystemCalls, 0, 5),
    BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
    BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_io_uring_setup, 3, 0),
    BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_socket, 0, 3),
    BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args[0])),
    BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, AF_UNIX, 1, 0),
    BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EACCES),
    BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
}};

Error failed(std::string why) { return {ErrorCode::kInternal, "the converter: " + why, ""}; }

/// Calls only async-signal-safe functions: the child of a process with threads.
[[noreturn]] void become(char* const* arguments, int in, int out, int said,
                         const ConvertLimits& limits) {
  const auto limit = [](auto what, std::uint64_t value) {
    const rlimit both = {value, value};
    return ::setrlimit(what, &both) == 0;
  };
  const sock_fprog filter = {static_cast<unsigned short>(kNoNetwork.size()),
                             const_cast<sock_filter*>(kNoNetwork.data())};
  const auto seconds = static_cast<std::uint64_t>(limits.time.count());
  const bool is_ready = ::setpgid(0, 0) == 0 && ::prctl(PR_SET_PDEATHSIG, SIGKILL) == 0 &&
                        ::dup2(in, 0) == 0 && ::dup2(out, 1) == 1 && ::dup2(said, 2) == 2 &&
                        ::close_range(3, ~0U, 0) == 0 && limit(RLIMIT_AS, limits.memory_bytes) &&
                        limit(RLIMIT_CPU, seconds + 1) &&
                        limit(RLIMIT_FSIZE, limits.memory_bytes) && limit(RLIMIT_CORE, 0) &&
                        ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
                        ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
  if (is_ready) {
    ::setpriority(PRIO_PROCESS, 0, kNiceness);
    ::execv(arguments[0], arguments);
  }
  ::_exit(127);
}

struct Ended {
  int status = 0;        ///< of waitpid()
  std::string said;      ///< on stderr
  bool is_late = false;  ///< was killed
};

/// Runs a program to its end. arguments: the first is its path.
Result<Ended> run(std::vector<std::string> arguments, int in, int out, const ConvertLimits& limits,
                  const std::stop_token& stop) {
  int ends[2] = {-1, -1};
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    return failed(std::strerror(errno));
  }
  UniqueFd read_end(ends[0]);
  UniqueFd write_end(ends[1]);
  std::vector<char*> words;
  for (std::string& word : arguments) {
    words.push_back(word.data());
  }
  words.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    become(words.data(), in, out, write_end.get(), limits);
  }
  if (child < 0) {
    return failed(std::strerror(errno));
  }
  ::setpgid(child, child);  // as the child does: the group is there before it is killed
  write_end = UniqueFd();
  Ended ended;
  const auto until = Clock::now() + limits.time;
  // The pipe ends with the process and those that it started.
  for (bool is_open = true; is_open;) {
    if (stop.stop_requested() || Clock::now() > until) {
      ended.is_late = true;
      break;
    }
    pollfd wait = {.fd = read_end.get(), .events = POLLIN, .revents = 0};
    constexpr int kGlanceMs = 100;  // between looks at the stop
    if (::poll(&wait, 1, kGlanceMs) <= 0) {
      continue;
    }
    std::array<char, 4096> text{};
    const ssize_t got = ::read(read_end.get(), text.data(), text.size());
    is_open = got > 0;
    if (is_open && ended.said.size() < kTextMost) {
      ended.said.append(text.data(), static_cast<std::size_t>(got));
    }
  }
  ::kill(-child, SIGKILL);  // An ended group is none.
  ::waitpid(child, &ended.status, 0);
  if (stop.stop_requested()) {
    return Error{ErrorCode::kCancelled, "stopped while converting", ""};
  }
  return ended;
}

/// Returns the lines that begin so, without that, in UTF-8: names in files are in any encoding.
std::vector<std::string> lines_of(const std::string& text, std::string_view begin) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string line = text.substr(at, end - at);
    std::replace_if(
        line.begin(), line.end(),
        [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, ' ');
    if (line.starts_with(begin)) {
      const GltfJson rest = line.substr(begin.size());
      const std::string json = rest.dump(-1, ' ', false, GltfJson::error_handler_t::replace);
      out.push_back(GltfJson::parse(json).get<std::string>());
    }
    at = end + 1;
  }
  return out;
}

/// Returns the error of a converter that has not ended well; empty if it has.
std::optional<Error> fault_of(const Ended& ended, const std::string& extension,
                              const ConvertLimits& limits) {
  const std::string what = "the " + extension + " file ";
  const int code = WIFEXITED(ended.status) ? WEXITSTATUS(ended.status) : -1;
  if (ended.is_late || (WIFSIGNALED(ended.status) && WTERMSIG(ended.status) == SIGXCPU)) {
    return Error{ErrorCode::kTooLarge,
                 what + "takes longer to convert than " + std::to_string(limits.time.count()) +
                     " s; send it as .glb",
                 ""};
  }
  if (code == kNoMemory) {
    return Error{ErrorCode::kTooLarge,
                 what + "takes more memory to convert than " +
                     std::to_string(limits.memory_bytes >> 20U) + " MiB; send it as .glb",
                 ""};
  }
  if (code == 0) {
    return std::nullopt;
  }
  const auto errors = lines_of(ended.said, kErrorLine);
  const std::string why = !errors.empty()             ? errors.front()
                          : WIFSIGNALED(ended.status) ? "its converter crashed on it"
                                                      : "its converter refused it";
  return Error{ErrorCode::kInvalidArgument, what + "cannot be converted: " + why, ""};
}

/// Sends the files to tessera-convert as one, and reads the GLB from another; neither has a name.
Result<Converted> by_helper(std::span<const FileToConvert> files, const std::string& extension,
                            const std::string& helper, const ConvertLimits& limits,
                            const std::stop_token& stop) {
  const UniqueFd in(::memfd_create("tessera-in", MFD_CLOEXEC));
  const UniqueFd out(::memfd_create("tessera-out", MFD_CLOEXEC));
  bool is_sent = in.get() >= 0 && out.get() >= 0;
  for (const FileToConvert& file : files) {
    const ConvertedFile head = {.name_bytes = file.name.size(), .bytes = file.content.size()};
    is_sent = is_sent && write_all(in.get(), &head, sizeof(head)) &&
              write_all(in.get(), file.name.data(), file.name.size()) &&
              write_all(in.get(), file.content.data(), file.content.size());
  }
  if (!is_sent || ::lseek(in.get(), 0, SEEK_SET) != 0) {
    return failed(std::strerror(errno));
  }
  const auto ended = run({helper, extension}, in.get(), out.get(), limits, stop);
  if (!ended) {
    return ended.error();
  }
  if (auto fault = fault_of(*ended, extension, limits)) {
    return *std::move(fault);
  }
  Converted converted{.glb = {}, .notes = lines_of(ended->said, kNoteLine)};
  converted.glb.resize(static_cast<std::size_t>(::lseek(out.get(), 0, SEEK_END)));
  std::size_t done = 0;
  while (done < converted.glb.size()) {
    const ssize_t got = ::pread(out.get(), converted.glb.data() + done, converted.glb.size() - done,
                                static_cast<off_t>(done));
    if (got <= 0) {
      return failed(std::strerror(errno));
    }
    done += static_cast<std::size_t>(got);
  }
  return converted;
}

bool write_file(const std::string& path, std::span<const std::byte> content) {
  const UniqueFd file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  return file.get() >= 0 && write_all(file.get(), content.data(), content.size());
}

Result<Converted> by_command(std::span<const FileToConvert> files, const std::string& extension,
                             const std::string& command, const ConvertLimits& limits,
                             const std::stop_token& stop) {
  const TemporaryFolder folder;
  const std::string input = folder.path() + "/model." + extension;
  const std::string output = folder.path() + "/model.glb";
  if (folder.path().empty() || !write_file(input, files.front().content)) {
    return failed(std::strerror(errno));
  }
  for (const FileToConvert& file : files.subspan(1)) {
    // By the last part: a name must not lead out of the folder.
    const std::string name = std::filesystem::path(file.name).filename().string();
    if (!name.empty() && name != "." && name != "..") {
      static_cast<void>(write_file(folder.path() + "/" + name, file.content));
    }
  }
  const UniqueFd nothing(::open("/dev/null", O_RDWR | O_CLOEXEC));
  const auto ended = run({command, input, output}, nothing.get(), nothing.get(), limits, stop);
  if (!ended) {
    return ended.error();
  }
  if (auto fault = fault_of(*ended, extension, limits)) {
    return *std::move(fault);
  }
  const UniqueFd file(::open(output.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  Converted converted{.glb = {}, .notes = lines_of(ended->said, kNoteLine)};
  std::array<std::byte, 65536> part{};
  for (ssize_t got = 1; got > 0;) {
    got = ::read(file.get(), part.data(), part.size());
    converted.glb.insert(converted.glb.end(), part.begin(),
                         part.begin() + std::max<ssize_t>(got, 0));
    if (converted.glb.size() > limits.memory_bytes) {
      break;
    }
  }
  if (converted.glb.empty()) {
    return Error{ErrorCode::kInvalidArgument,
                 "the " + extension + " file cannot be converted: its converter wrote nothing", ""};
  }
  return converted;
}

}  // namespace

bool Converters::takes(std::string_view extension) const {
  return commands.contains(extension) ||
         std::find(kOwn.begin(), kOwn.end(), extension) != kOwn.end();
}

std::string find_converter() {
  if (const char* named = std::getenv("TESSERA_CONVERTER"); named != nullptr && *named != '\0') {
    return ::access(named, X_OK) == 0 ? named : "";
  }
  std::error_code none;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", none).parent_path();
  for (const char* beside : {"tessera-convert", "../lib/tessera/tessera-convert"}) {
    const std::string path = (program / beside).string();
    if (::access(path.c_str(), X_OK) == 0) {
      return path;
    }
  }
  return "";
}

std::uint64_t conversion_bytes(std::string_view extension, std::uint64_t file_bytes) {
  constexpr std::uint64_t kLeast = std::uint64_t{512} << 20U;  // the program and its libraries
  return kLeast + file_bytes * (extension == "3mf" ? 128 : 32);
}

std::string extension_of_name(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  return in_lower_case(dot == std::string_view::npos ? "" : name.substr(dot + 1));
}

Result<Converted> convert_to_glb(std::span<const FileToConvert> files, const Converters& converters,
                                 const ConvertLimits& limits, const std::stop_token& stop) {
  const std::string extension = extension_of_name(files.front().name);
  if (const auto found = converters.commands.find(extension); found != converters.commands.end()) {
    return by_command(files, extension, found->second, limits, stop);
  }
  if (!converters.takes(extension)) {
    return Error{ErrorCode::kUnsupportedFormat,
                 "." + extension +
                     " files are not read: send .glb, .gltf or .zip, or start the server with "
                     "--converters " +
                     extension + "=PROGRAM",
                 ""};
  }
  if (converters.helper.empty()) {
    return Error{ErrorCode::kUnsupportedFormat,
                 "." + extension +
                     " files are read by a converter that is not installed here: start the server "
                     "with server/run --with-converters, or send .glb, .gltf or .zip",
                 ""};
  }
  return by_helper(files, extension, converters.helper, limits, stop);
}

}  // namespace core
