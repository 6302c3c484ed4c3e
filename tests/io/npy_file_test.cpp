#include "npy_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>

#include "scratch_folder.hpp"

namespace palpate {
namespace {

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

}  // namespace
}  // namespace palpate
