// Runs a fuzz target without libFuzzer: every seed unchanged, every seed truncated at many
// positions, then random mutations until the time is up. The seed of the random numbers is fixed,
// so that crashes are reproducible.
//   TARGET --seconds N SEED_FILE...
// The current input is stored in the file named by --last, mapped into memory: eight bytes of
// length, then the input. After a crash TARGET --show FILE prints it.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Clock = std::chrono::steady_clock;
using Random = std::mt19937;

constexpr std::size_t kInputMax = std::size_t{1} << 20U;
std::byte* g_last = nullptr;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

void map_last(const char* path) {
  const int file = open(path, O_RDWR | O_CREAT, 0600);
  if (file < 0 || ftruncate(file, static_cast<off_t>(kInputMax + 8)) != 0) {
    std::perror(path);
    std::exit(1);
  }
  void* place = mmap(nullptr, kInputMax + 8, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  g_last = place == MAP_FAILED ? nullptr : static_cast<std::byte*>(place);
  close(file);
}

void show_last(const char* path) {
  map_last(path);
  std::uint64_t size = 0;
  std::memcpy(&size, g_last, 8);
  std::fwrite(g_last + 8, 1, std::min<std::uint64_t>(size, kInputMax), stdout);
}

void try_input(const std::string& input) {
  const std::uint64_t size = std::min(input.size(), kInputMax);
  if (g_last != nullptr) {
    std::memcpy(g_last, &size, 8);
    std::memcpy(g_last + 8, input.data(), size);
  }
  // A copy of the exact size, so that a sanitizer detects a read beyond its end.
  const std::vector<std::uint8_t> exact(input.begin(),
                                        input.begin() + static_cast<std::ptrdiff_t>(size));
  LLVMFuzzerTestOneInput(exact.data(), exact.size());
}

std::size_t below(Random& random, std::size_t limit) {
  return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
}

/// Numbers and tokens that are likely to break parsers.
const std::vector<std::string>& words() {
  static const std::vector<std::string> list = {
      "0",       "-1",       "4294967295", "2147483648",
      "1e309",   "-0.0",     "null",       "true",
      "{}",      "[]",       "[[[[[[[[",   "\"\"",
      "\\u0000", "\xff\xfe", "NaN",        "18446744073709551616",
      "../x",    "data:,",   "{\"a\":",    ","};
  return list;
}

void mutate(std::string& text, Random& random) {
  const std::size_t at = text.empty() ? 0 : below(random, text.size());
  const std::size_t span =
      text.empty() ? 0 : below(random, std::min<std::size_t>(text.size() - at, 16) + 1);
  switch (below(random, 6)) {
    case 0:
      if (!text.empty()) {
        text[at] = static_cast<char>(text[at] ^ (1 << below(random, 8)));
      }
      break;
    case 1:
      text.erase(at, span);
      break;
    case 2:
      text.insert(at, text.substr(at, span));
      break;
    case 3:
      text.replace(at, span, words()[below(random, words().size())]);
      break;
    case 4:
      if (text.size() - at >= 4) {  // a binary size or count
        const std::uint32_t value =
            below(random, 2) == 0 ? 0xFFFFFFFFU : static_cast<std::uint32_t>(random());
        for (std::size_t i = 0; i < 4; ++i) {
          text[at + i] = static_cast<char>((value >> (8 * i)) & 255U);
        }
      }
      break;
    default:
      text.resize(at);
      break;
  }
}

}  // namespace

int main(int argc, char** argv) {
  double seconds = 10;
  std::vector<std::string> seeds = {""};
  for (int i = 1; i < argc; ++i) {
    const std::string_view arg = argv[i];
    if (arg == "--seconds" && i + 1 < argc) {
      seconds = std::atof(argv[++i]);
    } else if (arg == "--last" && i + 1 < argc) {
      map_last(argv[++i]);
    } else if (arg == "--show" && i + 1 < argc) {
      show_last(argv[i + 1]);
      return 0;
    } else {
      std::ifstream in(argv[i], std::ios::binary);
      seeds.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
  }
  const auto start = Clock::now();
  const auto left = [&] {
    return std::chrono::duration<double>(Clock::now() - start).count() < seconds;
  };
  Random random(1);
  std::size_t runs = 0;
  for (const std::string& seed : seeds) {
    try_input(seed);
    for (std::size_t i = 0; i < 50 && left(); ++i, ++runs) {
      try_input(seed.substr(0, below(random, seed.size() + 1)));
    }
  }
  while (left()) {
    std::string input = seeds[below(random, seeds.size())];
    for (std::size_t i = 0, n = 1 + below(random, 8); i < n; ++i) {
      mutate(input, random);
    }
    try_input(input);
    ++runs;
  }
  std::printf("%zu inputs in %.0f s, no crash\n", runs,
              std::chrono::duration<double>(Clock::now() - start).count());
  return 0;
}
