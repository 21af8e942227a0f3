/// Runs the steps of a loop on several threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>
#include <vector>

namespace core {

/// Calls body(0) to body(count - 1), in any order, on any threads; returns when all are done.
using ParallelFor = std::function<void(int count, const std::function<void(int)>& body)>;

/// Returns a ParallelFor with its own threads, the calling one among them. Its body must not throw.
inline ParallelFor parallel_for(int threads) {
  return [threads](int count, const std::function<void(int)>& body) {
    std::atomic<int> next = 0;
    const auto work = [&] {
      for (int i = next++; i < count; i = next++) {
        body(i);
      }
    };
    std::vector<std::jthread> others;
    for (int i = 1; i < std::min(threads, count); ++i) {
      others.emplace_back(work);
    }
    work();
  };
}

}  // namespace core
