/// The enumerators of an enum class whose values count up from 0, by their names in the compiler's
/// text: a new one is tested without a change of the tests.
#pragma once

#include <string_view>
#include <vector>

namespace test_support {

/// Whether a value has a name. GCC and clang end the text with "(core::StopReason)12]" if it has
/// none, else with "core::StopReason::kNone]".
template <auto kValue>
constexpr bool is_enumerator() {
  constexpr std::string_view kText = __PRETTY_FUNCTION__;
  const char first = kText[kText.find_last_of(":)") + 1];
  return first < '0' || first > '9';
}

template <typename Enum, int kFrom = 0>
std::vector<Enum> enumerators() {
  if constexpr (is_enumerator<static_cast<Enum>(kFrom)>()) {
    std::vector<Enum> all = enumerators<Enum, kFrom + 1>();
    all.insert(all.begin(), static_cast<Enum>(kFrom));
    return all;
  }
  return {};
}

}  // namespace test_support
