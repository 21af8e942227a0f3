#include "tests/simulation/faults.h"

#include <optional>

namespace simulation {
namespace {

/// A fault is the n-th of so many times that it could happen: what was idle does much at once, and
/// must not always fail at its beginning.
constexpr std::size_t kSpread = 8;

struct Kind {
  std::uint64_t count = 0;
  std::optional<Nanoseconds> due;
  std::size_t passed_over = 0;
};

std::array<Kind, kFaults.size()> kinds{};
std::optional<Random> draws;

}  // namespace

void seed_faults(std::uint64_t seed) { draws.emplace(seed); }

bool strikes(Fault kind) {
  Kind& of = kinds[static_cast<std::size_t>(kind)];
  if (of.due && now() < *of.due) {
    return false;
  }
  if (of.due && of.passed_over > 0) {
    --of.passed_over;
    return false;
  }
  const bool is_due = of.due.has_value();
  const double mean = static_cast<double>(kDay) / row_of(kind).a_day;
  of.due = now() + static_cast<Nanoseconds>(draws->exponential(mean));
  of.passed_over = draws->below(kSpread);
  of.count += is_due ? 1U : 0U;
  return is_due;
}

double chance_at_start(Fault kind) {
  // Half of the lives can lose the power, half are killed only.
  constexpr double kStarts = static_cast<double>(kDay) / kShift +
                             (row_of(Fault::kKilled).a_day + row_of(Fault::kPowerLost).a_day) / 2 +
                             row_of(Fault::kStopped).a_day;
  return row_of(kind).a_day / kStarts;
}

void count_fault(Fault kind) { ++kinds[static_cast<std::size_t>(kind)].count; }

bool has_happened(Fault kind) { return kinds[static_cast<std::size_t>(kind)].count > 0; }

std::string fault_counts() {
  std::string words;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (kinds[i].count > 0) {
      words += (words.empty() ? "" : " ") + std::string(kFaults[i].name) + " " +
               std::to_string(kinds[i].count);
    }
  }
  return words;
}

}  // namespace simulation
