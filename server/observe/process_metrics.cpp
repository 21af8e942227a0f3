#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <sys/resource.h>
#include <unistd.h>

#include "server/observe/metrics.h"

namespace server {
namespace {

/// Returns the time of the machine's start in seconds since 1970; 0: unknown.
double boot_seconds() {
  std::ifstream file("/proc/stat");
  for (std::string word; file >> word;) {
    double value = 0;
    if (word == "btime" && file >> value) {
      return value;
    }
  }
  return 0;
}

/// proc(5): /proc/PID/stat after the name, which is in brackets and may contain spaces.
struct ProcessStat {
  double cpu_seconds = 0;
  double threads = 0;
  double start_seconds = 0;
  double virtual_bytes = 0;
  double resident_bytes = 0;
};

ProcessStat read_stat() {
  constexpr int kFirst = 3;  // First field after the name.
  constexpr int kUserTicks = 14;
  constexpr int kSystemTicks = 15;
  constexpr int kThreads = 20;
  constexpr int kStartTicks = 22;
  constexpr int kVirtualBytes = 23;
  constexpr int kResidentPages = 24;
  std::ifstream file("/proc/self/stat");
  std::string text;
  std::getline(file, text);
  std::istringstream fields(text.substr(text.rfind(')') + 1));
  const auto ticks = static_cast<double>(::sysconf(_SC_CLK_TCK));
  ProcessStat stat;
  std::string field;
  for (int i = kFirst; i <= kResidentPages && fields >> field; ++i) {
    if (i == kUserTicks || i == kSystemTicks) {
      stat.cpu_seconds += std::stod(field) / ticks;
    } else if (i == kThreads) {
      stat.threads = std::stod(field);
    } else if (i == kStartTicks) {
      stat.start_seconds = boot_seconds() + std::stod(field) / ticks;
    } else if (i == kVirtualBytes) {
      stat.virtual_bytes = std::stod(field);
    } else if (i == kResidentPages) {
      stat.resident_bytes = std::stod(field) * static_cast<double>(::sysconf(_SC_PAGESIZE));
    }
  }
  return stat;
}

double open_files() {
  std::error_code failure;
  double count = 0;
  for (auto file = std::filesystem::directory_iterator("/proc/self/fd", failure);
       !failure && file != std::filesystem::directory_iterator(); file.increment(failure)) {
    ++count;
  }
  return count - 1;  // Excludes the descriptor of the folder itself.
}

}  // namespace

void write_process_metrics(MetricsText& text) {
  const ProcessStat stat = read_stat();
  text.counter("process_cpu_seconds_total", "User and system CPU time.", stat.cpu_seconds);
  text.gauge("process_start_time_seconds", "Start time since 1970.", stat.start_seconds);
  text.gauge("process_resident_memory_bytes", "Resident memory.", stat.resident_bytes);
  text.gauge("process_virtual_memory_bytes", "Virtual memory.", stat.virtual_bytes);
  text.gauge("process_threads", "Threads.", stat.threads);
  text.gauge("process_open_fds", "Open file descriptors.", open_files());
  rlimit limit = {};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    text.gauge("process_max_fds", "Maximum number of open file descriptors.",
               static_cast<double>(limit.rlim_cur));
  }
}

}  // namespace server
