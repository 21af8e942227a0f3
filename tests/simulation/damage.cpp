#include "tests/simulation/damage.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <vector>

namespace simulation {
namespace {

void flip(const std::filesystem::path& path, std::uint64_t place, unsigned bit) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekg(static_cast<std::streamoff>(place));
  const auto byte = static_cast<unsigned>(file.get());
  file.seekp(static_cast<std::streamoff>(place));
  file.put(static_cast<char>(byte ^ 1U << bit));
}

}  // namespace

std::string damage_film(const std::string& data, Random& random) {
  std::vector<std::filesystem::path> films;
  std::error_code none;  // The process may have ended before it made the folder.
  for (const auto& entry : std::filesystem::directory_iterator(data + "/films", none)) {
    if (entry.file_size() > 0) {
      films.push_back(entry.path());
    }
  }
  if (films.empty()) {
    return "";
  }
  std::sort(films.begin(), films.end());
  const std::filesystem::path& film = films[random.below(films.size())];
  flip(film, random.below(std::filesystem::file_size(film)),
       static_cast<unsigned>(random.below(8)));
  return film.stem().string();
}

bool damage_log(const std::string& data, Random& random) {
  const std::string log = data + "/tessera.db-wal";
  std::ifstream mark(data + "/tessera.db-mark");
  std::string kind;
  std::uint64_t salt1 = 0;
  std::uint64_t salt2 = 0;
  std::uint64_t pages = 0;
  mark >> kind >> salt1 >> salt2 >> pages;
  std::array<unsigned char, 32> head{};
  std::ifstream file(log, std::ios::binary);
  if (kind != "log" || pages == 0 ||
      !file.read(reinterpret_cast<char*>(head.data()), head.size())) {
    return false;
  }
  const auto word = [&head](std::size_t at) {
    return std::uint64_t{head[at]} << 24U | std::uint64_t{head[at + 1]} << 16U |
           std::uint64_t{head[at + 2]} << 8U | std::uint64_t{head[at + 3]};
  };
  if (word(16) != salt1 || word(20) != salt2) {
    return false;
  }
  flip(log, random.below(head.size() + pages * (24 + word(8))),
       static_cast<unsigned>(random.below(8)));
  return true;
}

}  // namespace simulation
