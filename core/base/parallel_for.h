/// Runs the steps of a loop on several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <system_error>
#include <thread>
#include <vector>

namespace core {

/// Calls body(0) to body(count - 1), in any order, on any threads; returns when all are done.
using ParallelFor = std::function<void(int count, const std::function<void(int)>& body)>;

/// Returns a ParallelFor with its own threads, the calling one among them; fewer than `threads`
/// where the system has no memory for more. After an exception of the body the remaining steps are
/// left out, and one of the exceptions is thrown again.
inline ParallelFor parallel_for(int threads) {
  return [threads](int count, const std::function<void(int)>& body) {
    std::atomic<int> next = 0;
    std::atomic<bool> has_failed = false;
    std::exception_ptr failure;  // of the thread that sets has_failed
    const auto work = [&]() noexcept {
      try {
        for (int i = next++; i < count && !has_failed; i = next++) {
          body(i);
        }
      } catch (...) {
        if (!has_failed.exchange(true)) {
          failure = std::current_exception();
        }
      }
    };
    {
      const int more = std::max(std::min(threads, count) - 1, 0);
      std::vector<std::jthread> others;
      others.reserve(static_cast<std::size_t>(more));
      try {
        for (int i = 0; i < more; ++i) {
          others.emplace_back(work);
        }
      } catch (const std::system_error&) {  // The threads that there are do all steps.
      }
      work();
    }
    if (failure) {
      std::rethrow_exception(failure);
    }
  };
}

}  // namespace core
