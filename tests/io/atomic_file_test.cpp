#include "io/atomic_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "palpate/files.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::atomic_file_test {

std::size_t files_in(const ScratchFolder& folder) {
  return static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator(folder.path()), {}));
}

// For its lifetime, files of this process may not grow beyond the size: a full disk, in small.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

OccupancyGrid map_of(int cells) {
  OccupancyGrid map;
  map.nx = cells;
  map.ny = 1;
  map.log_odds.assign(static_cast<std::size_t>(cells), 1.0f);
  return map;
}

TEST(AtomicFile, AppearsOnCommitOnly) {
  const ScratchFolder folder;
  const std::filesystem::path target = folder / "a.txt";
  put_bytes(target, "old");
  {
    AtomicFile file(target);
    file.write("new");
    EXPECT_EQ(bytes_of(target), "old");
  }
  EXPECT_EQ(bytes_of(target), "old");
  EXPECT_EQ(files_in(folder), 1u);
  AtomicFile file(target);
  put_bytes(file.path(), "new");  // as a library would, by name
  file.commit();
  EXPECT_EQ(bytes_of(target), "new");
  EXPECT_EQ(files_in(folder), 1u);
}

TEST(AtomicFile, LeavesLinksInPlace) {
  const ScratchFolder folder;
  put_bytes(folder / "a.txt", "old");
  std::filesystem::create_symlink("a.txt", folder / "link");
  AtomicFile file(folder / "link");
  file.write("new");
  file.commit();
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(bytes_of(folder / "a.txt"), "new");
}

TEST(AtomicFile, ReplacesLinksWhereAsked) {
  const ScratchFolder folder;
  std::filesystem::create_directory(folder / "folder");
  put_bytes(folder / "a.txt", "old");
  for (const char* behind : {"a.txt", "folder", "missing"}) {
    std::filesystem::create_symlink(behind, folder / "link");
    AtomicFile file(folder / "link", AtomicFile::Links::replaced);
    file.write("new");
    file.commit();
    EXPECT_TRUE(std::filesystem::is_regular_file(std::filesystem::symlink_status(folder / "link")));
    std::filesystem::remove(folder / "link");
  }
  EXPECT_EQ(bytes_of(folder / "a.txt"), "old");
  EXPECT_FALSE(std::filesystem::exists(folder / "missing"));
}

TEST(AtomicFile, IsAsReadableAsAnyOther) {
  const ScratchFolder folder;
  put_bytes(folder / "plain", "");
  AtomicFile file(folder / "atomic");
  file.commit();
  EXPECT_EQ(std::filesystem::status(folder / "atomic").permissions(),
            std::filesystem::status(folder / "plain").permissions());
}

TEST(AtomicFile, NamesTargetsThatItCannotBe) {
  const ScratchFolder folder;
  const std::string missing = (folder / "no" / "a.h5").string();
  expect_named(input_error([&] { AtomicFile file(missing); }),
               {missing.c_str(), "does not exist", "mkdir -p"});
  expect_named(input_error([&] { AtomicFile file(folder.path()); }),
               {folder.path().c_str(), "is a folder"});
  expect_named(input_error([&] { AtomicFile file("/dev/full"); }), {"/dev/full", "regular"});
  put_bytes(folder / "a.txt", "");
  const std::string below_file = (folder / "a.txt" / "b").string();
  expect_named(input_error([&] { AtomicFile file(below_file); }), {below_file.c_str()});
  EXPECT_EQ(files_in(folder), 1u);
}

TEST(AtomicFile, KeepsTheOldFileWhereTheDiskIsFull) {
  const ScratchFolder folder;
  write_map(folder / "a.h5", map_of(10));
  const std::string old = bytes_of(folder / "a.h5");
  {
    const FullDisk full(4096);
    try {
      write_map(folder / "a.h5", map_of(100'000));
      ADD_FAILURE() << "a full disk went unnoticed";
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::system);
      expect_named(error.what(), {"a.h5", "write"});
    }
  }
  EXPECT_EQ(bytes_of(folder / "a.h5"), old);
  EXPECT_EQ(files_in(folder), 1u);
}

TEST(AtomicFile, LeavesNeitherOfAPairWhereTheDiskIsFull) {
  const ScratchFolder folder;
  {
    const FullDisk full(4096);
    EXPECT_THROW(write_map_server(folder / "a.yaml", map_of(100'000)), Error);
  }
  EXPECT_EQ(files_in(folder), 0u);
}

}  // namespace palpate::atomic_file_test
