// Runs a fuzz target without a fuzzer, with any compiler: on every file of a folder and on a number of mutations, which
// are the same on every machine. A failure ends the program as it ends a fuzzer, after a line that names the input. The
// exit status is 1 if there is no file.
#include <algorithm>
#include <array>
#include <charconv>
#include <csignal>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include "target.h"

// Defined by fuzz targets with their own mutator; null otherwise.
extern "C" [[gnu::weak]] std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t maxSize,
                                                             unsigned seed);

namespace {

namespace fs = std::filesystem;
using namespace hpsdf;

constexpr std::size_t kMostGrowth = 64;  // bytes that mutations may add to a file
std::mt19937 random_;                    // portable, unlike the distributions of <random>

std::size_t below(std::size_t count) { return count == 0 ? 0 : random_() % count; }

std::array<char, 256> input{};  // name of the current input, printed when the program crashes

extern "C" void tellInput(int signal) {
  std::cerr << "replay: " << input.data() << std::endl;  // not signal-safe, but the program ends anyway
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void run(const std::string& name, const std::vector<std::uint8_t>& bytes) {
  input.fill('\0');
  std::ranges::copy(name.substr(0, input.size() - 1), input.begin());
  // The copy has exactly the input's size, so that AddressSanitizer detects reads beyond its end.
  LLVMFuzzerTestOneInput(std::vector<std::uint8_t>(bytes).data(), bytes.size());
}

struct Seed {
  std::string name;
  std::vector<std::uint8_t> bytes;
};

std::vector<Seed> seedsIn(const std::vector<fs::path>& folders) {
  std::vector<Seed> seeds;
  for (const fs::path& folder : folders)
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      const std::string bytes = fuzz::bytesOf(entry.path());
      seeds.push_back({entry.path().filename(), {bytes.begin(), bytes.end()}});
    }
  std::ranges::sort(seeds, {}, &Seed::name);
  return seeds;
}

std::vector<std::uint8_t> mutated(const Seed& seed) {
  const std::size_t most = seed.bytes.size() + kMostGrowth;
  std::vector<std::uint8_t> bytes = seed.bytes;
  bytes.resize(most);
  const unsigned choice = static_cast<unsigned>(random_());
  bytes.resize(LLVMFuzzerCustomMutator ? LLVMFuzzerCustomMutator(bytes.data(), seed.bytes.size(), most, choice)
                                       : LLVMFuzzerMutate(bytes.data(), seed.bytes.size(), most));
  return bytes;
}

std::size_t numberOf(const char* text) {
  std::size_t number = 0;
  std::from_chars(text, text + std::strlen(text), number);
  return number;
}

}  // namespace

/// Makes one to four changes: a flipped bit, another byte, a special number, or a piece copied, removed or inserted.
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t maxSize) {
  constexpr std::array<std::uint64_t, 10> kNumbers = {
      0, 1, 0x7f, 0xff, 0x7fffffff, 0xffffffff, 0x7ff0000000000000, 0x7ff8000000000000, 0x7fffffffffffffff, ~0ull};
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
    const std::size_t at = below(size), length = 1 + below(std::min<std::size_t>(size - at, 32));
    switch (below(6)) {
      case 0:
        if (size > 0) data[at] ^= static_cast<std::uint8_t>(1u << below(8));
        break;
      case 1:
        if (size > 0) data[at] = static_cast<std::uint8_t>(random_());
        break;
      case 2:
        std::memcpy(data + at, &kNumbers[below(kNumbers.size())], std::min<std::size_t>(size - at, 1u << below(4)));
        break;
      case 3:
        if (size > 0) std::memmove(data + below(size - length + 1), data + at, length);
        break;
      case 4:
        if (size <= length) break;
        std::memmove(data + at, data + at + length, size - at - length);
        size -= length;
        break;
      default:
        if (size == 0 || size + length > maxSize) break;
        std::memmove(data + at + length, data + at, size - at);
        size += length;
    }
  }
  return size;
}

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() < 2) {
    std::cerr << "usage: " << argv[0] << " MUTATIONS FOLDER…" << std::endl;
    return 1;
  }
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, tellInput);
  const std::vector<Seed> seeds = seedsIn({words.begin() + 1, words.end()});
  if (seeds.empty()) {
    std::cerr << "replay: no file in " << words[1] << std::endl;
    return 1;
  }
  for (const Seed& seed : seeds) run(seed.name, seed.bytes);
  const std::size_t mutations = numberOf(argv[1]);
  for (std::size_t n = 0; n < mutations; ++n) {
    const Seed& seed = seeds[n % seeds.size()];
    random_.seed(static_cast<unsigned>(n));
    run(seed.name + ", mutation " + std::to_string(n), mutated(seed));
  }
  std::cout << seeds.size() << " files and " << mutations << " mutations of them" << std::endl;
}
