#include "server/http/negotiation.h"

#include <string>
#include <utility>
#include <vector>

#include "server/http/text.h"

namespace server {
namespace {

/// Parses a quality in thousandths: "0.5" is 500. Empty when malformed (RFC 9110 12.4.2).
std::optional<int> parse_quality(std::string_view text) {
  if (text.empty() || text.size() > 5 || (text[0] != '0' && text[0] != '1')) {
    return std::nullopt;
  }
  int thousandths = (text[0] - '0') * 1000;
  if (text.size() > 1 && text[1] != '.') {
    return std::nullopt;
  }
  int place = 100;
  for (const char c : text.substr(text.size() > 1 ? 2 : 1)) {
    if (c < '0' || c > '9') {
      return std::nullopt;
    }
    thousandths += (c - '0') * place;
    place /= 10;
  }
  return thousandths <= 1000 ? std::optional<int>(thousandths) : std::nullopt;
}

struct Preference {
  std::string name;  ///< In lower case, without parameters.
  int quality = 1000;
};

std::optional<Preference> parse_preference(std::string_view element) {
  Preference preference;
  preference.name = media_type(element);
  std::size_t semicolon = element.find(';');
  while (semicolon != std::string_view::npos) {
    element.remove_prefix(semicolon + 1);
    semicolon = element.find(';');
    const std::string_view parameter = trim(element.substr(0, semicolon));
    if (parameter.size() >= 2 && (parameter[0] == 'q' || parameter[0] == 'Q') &&
        parameter[1] == '=') {
      const auto quality = parse_quality(parameter.substr(2));
      if (!quality) {
        return std::nullopt;
      }
      preference.quality = *quality;
    }
  }
  return preference;
}

constexpr int kNamed = 3;

/// Returns kNamed for the type itself, 2 for `type/*`, 1 for `*/*`, 0 for no match.
int specificity(std::string_view range, std::string_view offer) {
  if (range == offer) {
    return kNamed;
  }
  if (range == "*/*" || range == "*") {
    return 1;
  }
  const bool is_prefix = range.size() > 2 && range.substr(range.size() - 2) == "/*" &&
                         offer.substr(0, range.size() - 1) == range.substr(0, range.size() - 1);
  return is_prefix ? 2 : 0;
}

}  // namespace

std::optional<std::size_t> negotiate_media_type(std::string_view accept,
                                                std::span<const std::string_view> offers) {
  if (trim(accept).empty()) {
    return offers.empty() ? std::nullopt : std::optional<std::size_t>(0);
  }
  std::vector<Preference> preferences;
  for (const std::string_view element : split_list(accept)) {
    if (auto preference = parse_preference(element)) {
      preferences.push_back(std::move(*preference));
    }
  }
  std::optional<std::size_t> best;
  std::pair<int, std::ptrdiff_t>
      best_rank;  // greater is better: quality, and how early it is named
  for (std::size_t i = 0; i < offers.size(); ++i) {
    std::pair<int, std::ptrdiff_t> rank;
    int best_specificity = 0;
    for (std::size_t place = 0; place < preferences.size(); ++place) {
      // The most specific range decides, even if a less specific one has a higher quality.
      const int fit = specificity(preferences[place].name, offers[i]);
      if (fit > best_specificity) {
        best_specificity = fit;
        rank = {preferences[place].quality,
                fit == kNamed ? static_cast<std::ptrdiff_t>(preferences.size() - place) : 0};
      }
    }
    if (rank.first > 0 && rank > best_rank) {
      best_rank = rank;
      best = i;
    }
  }
  return best;
}

bool accepts_encoding(std::string_view accept_encoding, std::string_view coding) {
  int wildcard_quality = 0;
  for (const std::string_view element : split_list(accept_encoding)) {
    const auto preference = parse_preference(element);
    if (!preference) {
      continue;
    }
    if (preference->name == coding) {
      return preference->quality > 0;
    }
    if (preference->name == "*") {
      wildcard_quality = preference->quality;
    }
  }
  return wildcard_quality > 0;
}

}  // namespace server
