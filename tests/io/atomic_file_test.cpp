#include "io/atomic_file.hpp"

#include <gtest/gtest.h>

#include <csignal>

#include "file_parts.hpp"
#include "palpate/files.hpp"
#include "support/child_process.hpp"

namespace palpate::atomic_file_test {

class AtomicFiles : public OneFile {
 protected:
  AtomicFiles() { put_bytes(path_, "old"); }

  std::ptrdiff_t files() const {
    return std::distance(std::filesystem::directory_iterator(folder_.path()), {});
  }
  static void write_new(const std::filesystem::path& path,
                        AtomicFile::Links links = AtomicFile::Links::followed) {
    AtomicFile file(path, links);
    file.write("new");
    file.commit();
  }
};

TEST_F(AtomicFiles, AppearOnCommitOnly) {
  {
    AtomicFile file(path_);
    file.write("new");
    EXPECT_EQ(bytes_of(path_), "old");
  }
  EXPECT_EQ(bytes_of(path_), "old");
  EXPECT_EQ(files(), 1);
  AtomicFile file(path_);
  put_bytes(file.path(), "new");  // as a library would, by name
  const auto readable = std::filesystem::status(path_).permissions();
  file.commit();
  EXPECT_EQ(bytes_of(path_), "new");
  EXPECT_EQ(files(), 1);
  EXPECT_EQ(std::filesystem::status(path_).permissions(), readable) << "as any other file";
}

TEST_F(AtomicFiles, LeaveLinksInPlaceOrReplaceThemWhereAsked) {
  const std::filesystem::path link = folder_ / "link";
  std::filesystem::create_directory(folder_ / "folder");
  for (const char* behind : {"file.h5", "folder", "missing"}) {
    std::filesystem::create_symlink(behind, link);
    write_new(link, AtomicFile::Links::replaced);
    EXPECT_TRUE(std::filesystem::is_regular_file(std::filesystem::symlink_status(link))) << behind;
    std::filesystem::remove(link);
  }
  EXPECT_EQ(bytes_of(path_), "old");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "missing"));
  std::filesystem::create_symlink("file.h5", link);
  write_new(link);
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(bytes_of(path_), "new");
}

TEST_F(AtomicFiles, NameTargetsThatTheyCannotBe) {
  for (const auto& [target, why] : {std::pair{(folder_ / "no" / "a.h5").string(), "does not exist"},
                                    {folder_.path().string(), "is a folder"},
                                    {"/dev/full", "regular"},
                                    {(path_ / "b").string(), ""}}) {
    expect_named(input_error([&] { AtomicFile file(target); }), {target.c_str(), why});
  }
  EXPECT_EQ(files(), 1);
}

TEST_F(AtomicFiles, KeepTheOldOnesWhereTheDiskIsFull) {
  OccupancyGrid map{.nx = 100'000, .ny = 1};
  map.log_odds.assign(100'000, 1.0F);
  const int status = status_of([&] {
    std::signal(SIGXFSZ, SIG_IGN);  // errors of writing, not signals
    limit_process(RLIMIT_FSIZE, 4096);
    expect_named(error_of(Fault::system, [&] { write_map(path_, map); }), {"file.h5", "write"});
    error_of(Fault::system, [&] { write_map_server(folder_ / "a.yaml", map); });
  });
  EXPECT_EQ(status, 0);
  EXPECT_EQ(bytes_of(path_), "old");
  EXPECT_EQ(files(), 1) << "nor one of a pair";
}

}  // namespace palpate::atomic_file_test
