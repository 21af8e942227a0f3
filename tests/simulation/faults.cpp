#include "tests/simulation/faults.h"

namespace simulation {
namespace {

std::array<std::uint64_t, kFaultNames.size()> counts{};

}  // namespace

void count_fault(Fault kind) { ++counts[static_cast<std::size_t>(kind)]; }

std::string fault_counts() {
  std::string words;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0) {
      words += (words.empty() ? "" : " ") + std::string(kFaultNames[i]) + " " +
               std::to_string(counts[i]);
    }
  }
  return words;
}

}  // namespace simulation
