#include "io/npy_file.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <numeric>
#include <random>

#include <fmt/format.h>

#include "io/descriptor.hpp"
#include "scratch_folder.hpp"

namespace palpate::npy_file_test {

class Npy : public testing::Test {
 protected:
  // A file of version 1.0 with this dictionary and these bytes of numbers.
  void put(const std::string& dictionary, const std::string& numbers) const {
    const auto size = static_cast<std::uint16_t>(dictionary.size());
    std::string bytes("\x93NUMPY\x01\x00", 8);
    bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
    put_bytes(path_, bytes + dictionary + numbers);
  }

  template <typename Number>
  static std::string bytes(const std::vector<Number>& numbers) {
    return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
  }

  std::string message(const std::string& dictionary, const std::string& numbers = "") const {
    put(dictionary, numbers);
    return input_error([&] { read_npy(path_); });
  }

  template <typename Number>
  void expect_read(const char* descr) const {
    put("{'descr': '" + std::string(descr) + "', 'fortran_order': False, 'shape': (2, 3), }\n",
        bytes(std::vector<Number>{1, 2, 3, 4, 5, 127}));
    const NpyArray array = read_npy(path_);
    EXPECT_EQ(array.shape, (std::vector<std::size_t>{2, 3})) << descr;
    EXPECT_EQ(array.values, (std::vector<double>{1, 2, 3, 4, 5, 127})) << descr;
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "p.npy";
};

TEST_F(Npy, ReadsFloatsAndIntegers) {
  expect_read<float>("<f4");
  expect_read<double>("<f8");
  expect_read<std::int8_t>("|i1");
  expect_read<std::uint8_t>("|u1");
  expect_read<std::int16_t>("<i2");
  expect_read<std::uint16_t>("<u2");
  expect_read<std::int32_t>("<i4");
  expect_read<std::uint32_t>("<u4");
  expect_read<std::int64_t>("<i8");
  expect_read<std::uint64_t>("<u8");
  EXPECT_TRUE(is_npy(path_));
  put_bytes(path_, "1,2\n");
  EXPECT_FALSE(is_npy(path_));
}

// Element [i, j, k] = 100 i + 10 j + k, stored with i fastest.
TEST_F(Npy, ReadsFortranOrder) {
  std::vector<float> stored;
  std::vector<double> expected;
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 2; ++i) {
        stored.push_back(static_cast<float>(100 * i + 10 * j + k));
      }
    }
  }
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (int k = 0; k < 4; ++k) {
        expected.push_back(100 * i + 10 * j + k);
      }
    }
  }
  put("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3, 4), }", bytes(stored));
  EXPECT_EQ(read_npy(path_).values, expected);
}

TEST_F(Npy, NamesWhatIsWrong) {
  const std::string eight = bytes(std::vector<double>{1.0});
  const auto header = [](const std::string& descr, const std::string& shape) {
    return "{'descr': '" + descr + "', 'fortran_order': False, 'shape': " + shape + ", }";
  };
  expect_named(message(header(">f8", "(1,)"), eight), {"p.npy: ", "'>f8'", "float32"});
  expect_named(message(header("<f2", "(4,)"), eight), {"'<f2'"});
  expect_named(message(header("<c8", "(1,)"), eight), {"'<c8'"});
  expect_named(message(header("|O", "(1,)"), eight), {"'|O'"});
  expect_named(message(header("<f8", "(2, 1)"), eight), {"8 bytes", "(2, 1)", "makes 16"});
  expect_named(message(header("<f8", "(1,)"), eight + "x"), {"9 bytes"});
  expect_named(message(header("<f8", "(4294967296, 4294967296)"), eight), {"8 bytes"});
  expect_named(message("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (1,), }", eight),
               {"named fields"});
  for (const char* broken : {"", "{}", "{'descr': '<f8', 'fortran_order': False, }",
                             "{'descr': '<f8', 'fortran_order': 0, 'shape': (1,), }",
                             "{'descr': '<f8', 'descr': '<f8', 'shape': (1,), }",
                             "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }",
                             "{'descr': '<f8', 'fortran_order': False, 'shape': (1 2), }",
                             "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), 'more': 1}",
                             "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), } x"}) {
    expect_named(message(broken, eight), {"NPY header is damaged"});
  }
  put_bytes(path_, std::string("\x93NUMPY\x04\x00\x00\x00\x00\x00", 12));
  expect_named(input_error([&] { read_npy(path_); }), {"newer NPY version"});
  put_bytes(path_, std::string("\x93NUMPY\x01\x00\xff\x00{", 11));
  expect_named(input_error([&] { read_npy(path_); }), {"cut off"});
  put_bytes(path_, "\x93NUMPY");
  expect_named(input_error([&] { read_npy(path_); }), {"cut off"});
}

/// A file in memory, which may be sparse and is quick to write.
class NpyInMemory : public testing::Test {
 protected:
  void put(const std::string& bytes, off_t size) const {
    ASSERT_EQ(::ftruncate(file_.get(), 0), 0);
    ASSERT_EQ(::pwrite(file_.get(), bytes.data(), bytes.size(), 0),
              static_cast<ssize_t>(bytes.size()));
    ASSERT_EQ(::ftruncate(file_.get(), size), 0);
  }

  Descriptor file_{::memfd_create("p.npy", MFD_CLOEXEC)};
  std::filesystem::path path_ = fmt::format("/proc/self/fd/{}", file_.get());
};

// 4 EiB of numbers, which take more bytes as doubles than 64 bits count.
TEST_F(NpyInMemory, MoreNumbersThanMemoryAreRefused) {
  for (const char* order : {"False", "True"}) {
    const std::string dictionary = fmt::format(
        "{{'descr': '|u1', 'fortran_order': {}, 'shape': (4611686018427387904,), }}", order);
    const std::string header = std::string("\x93NUMPY\x01\x00", 8) +
                               static_cast<char>(dictionary.size()) + '\0' + dictionary;
    put(header, static_cast<off_t>(header.size() + (1ULL << 62)));
    EXPECT_THROW(read_npy(path_), std::length_error);
  }
}

/// Writes what numpy.save or a forger may have written: arrays of few numbers, most of which lie or
/// are damaged somewhere.
class Forger {
 public:
  std::string file() {
    const std::string size_of_header = below(2) == 0 ? "\x01" : below(2) == 0 ? "\x02" : "\x03";
    const auto [descr, width] = type();
    std::size_t count = 1;
    const std::string dictionary =
        fmt::format("{{'descr': {}, 'fortran_order': {}, 'shape': {}, }}{}\n", descr,
                    one_of({"False", "True"}), shape(count), std::string(below(64), ' '));
    std::string all = "\x93NUMPY" + size_of_header + '\0';
    const auto size = static_cast<std::uint32_t>(dictionary.size());
    all.append(reinterpret_cast<const char*>(&size), size_of_header == "\x01" ? 2 : 4);
    all += dictionary + numbers(width * count);
    for (std::size_t damages = below(2) * below(4); damages > 0; --damages) {
      damage(all, magic_bytes + below(all.size() - magic_bytes));
    }
    return all;
  }

 private:
  static constexpr std::size_t magic_bytes = 6;

  std::size_t below(std::size_t bound) { return random_() % bound; }
  template <typename Value>
  Value one_of(std::initializer_list<Value> values) {
    return *(values.begin() + below(values.size()));
  }

  std::pair<const char*, std::size_t> type() {
    using Type = std::pair<const char*, std::size_t>;
    return below(4) > 0
               ? one_of<Type>(
                     {{"'<f4'", 4}, {"'<f8'", 8}, {"'|u1'", 1}, {"'<i2'", 2}, {"'<u8'", 8}})
               : one_of<Type>({{"'|O'", 8},
                               {"'>f8'", 8},
                               {"'>i4'", 4},
                               {"'<c16'", 16},
                               {"'|b1'", 1},
                               {"'<U7'", 28},
                               {"'|V8'", 8},
                               {"'<M8[ns]'", 8},
                               {"''", 1},
                               {"'", 1},
                               {"[('x', '<f4')]", 4},
                               {"None", 4},
                               {"'<f99999999999999999999'", 8}});
  }

  std::string shape(std::size_t& count) {
    std::string text = "(";
    for (std::size_t axes = below(5); axes > 0; --axes) {
      if (below(8) > 0) {
        const std::size_t extent = below(5);
        text += fmt::format("{}, ", extent);
        count *= extent;
      } else {
        text += one_of({"-1, ", "4294967296, ", "18446744073709551615, ", "9223372036854775807,",
                        "99999999999999999999, ", "1e3, ", "0x2, ", "2L, ", "2 ", ",", "(2,), "});
      }
    }
    return text + one_of({")", ")", ")", "", "))"});
  }

  std::string numbers(std::size_t bytes) {
    if (below(8) == 0) {
      return "\x80\x02"
             "cposix\nsystem\n(S'true'\ntR.";  // a pickle, which would run a command
    }
    std::string all(below(4) > 0 ? bytes : below(300), '\0');
    std::generate(all.begin(), all.end(), [this] { return static_cast<char>(random_()); });
    return all;
  }

  void damage(std::string& all, std::size_t place) {
    const std::size_t some = std::min(below(20), all.size() - place);
    switch (below(5)) {
      case 0:
        all[place] = static_cast<char>(all[place] ^ (1 << below(8)));
        break;
      case 1:
        all.erase(place, some);
        break;
      case 2:
        all.insert(place, all.substr(place, some));
        break;
      case 3:
        all[place] = static_cast<char>(random_());
        break;
      default:
        all.resize(place);
    }
    all.resize(std::max(all.size(), magic_bytes + 1));
  }

  std::mt19937 random_{20110509};
};

TEST_F(NpyInMemory, ForgedHeadersAreReadOrRefused) {
  constexpr int files = 8'000;
  Forger forger;
  int read = 0;
  for (int k = 0; k < files; ++k) {
    const std::string file = forger.file();
    put(file, static_cast<off_t>(file.size()));
    ASSERT_TRUE(is_npy(path_));
    try {
      const NpyArray array = read_npy(path_);
      const std::size_t count = std::accumulate(array.shape.begin(), array.shape.end(),
                                                std::size_t{1}, std::multiplies<>());
      ASSERT_EQ(array.values.size(), count) << testing::PrintToString(file);
      ASSERT_LT(count, file.size()) << testing::PrintToString(file);
      // None of these is among the types that are read.
      for (const char* other : {"'|O'", "'>", "'<c", "'|b", "'<U", "'|V", "'<M", "["}) {
        ASSERT_EQ(file.find(std::string("'descr': ") + other), file.npos)
            << testing::PrintToString(file);
      }
      ++read;
    } catch (const Error& error) {
      ASSERT_EQ(error.fault(), Fault::input) << error.what();
      ASSERT_TRUE(std::string(error.what()).starts_with(path_.string() + ": ")) << error.what();
    }
  }
  EXPECT_GT(read, files / 10) << "few files get past the header";
}

}  // namespace palpate::npy_file_test
