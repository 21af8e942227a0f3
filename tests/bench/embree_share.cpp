#include "tests/bench/embree_share.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <limits>

#include <link.h>
#include <sys/time.h>
#include <ucontext.h>

namespace bench {
namespace {

struct Range {
  std::uintptr_t first = 0;
  std::uintptr_t last = 0;
};

Range embree_code;
std::atomic<std::uint64_t> inside{0};
std::atomic<std::uint64_t> total{0};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free, "used in a signal handler");

int find_embree(dl_phdr_info* info, std::size_t /*size*/, void* /*user*/) {
  if (std::strstr(info->dlpi_name, "libembree") == nullptr) {
    return 0;
  }
  embree_code.first = std::numeric_limits<std::uintptr_t>::max();
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const auto& segment = info->dlpi_phdr[i];
    if (segment.p_type == PT_LOAD && (segment.p_flags & PF_X) != 0) {
      const std::uintptr_t at = info->dlpi_addr + segment.p_vaddr;
      embree_code.first = std::min(embree_code.first, at);
      embree_code.last = std::max(embree_code.last, at + segment.p_memsz);
    }
  }
  return 1;
}

void on_tick(int /*signal*/, siginfo_t* /*info*/, void* context) {
  const auto at = static_cast<std::uintptr_t>(
      static_cast<const ucontext_t*>(context)->uc_mcontext.gregs[REG_RIP]);
  total.fetch_add(1, std::memory_order_relaxed);
  if (at >= embree_code.first && at < embree_code.last) {
    inside.fetch_add(1, std::memory_order_relaxed);
  }
}

void set_timer(suseconds_t microseconds) {
  itimerval timer{};
  timer.it_interval.tv_usec = microseconds;
  timer.it_value.tv_usec = microseconds;
  setitimer(ITIMER_PROF, &timer, nullptr);
}

}  // namespace

EmbreeShare::EmbreeShare() {
  dl_iterate_phdr(&find_embree, nullptr);
  inside = 0;
  total = 0;
  struct sigaction action {};
  action.sa_sigaction = &on_tick;
  action.sa_flags = SA_SIGINFO | SA_RESTART;
  sigaction(SIGPROF, &action, nullptr);
  set_timer(5000);
}

EmbreeShare::~EmbreeShare() { set_timer(0); }

double EmbreeShare::share() const {
  return total > 0 ? static_cast<double>(inside) / static_cast<double>(total)
                   : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace bench
