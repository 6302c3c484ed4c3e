// Files that mean harm, or that only look so.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <functional>

#include "file_parts.hpp"
#include "io/file_summary.hpp"
#include "io/recording_survey.hpp"
#include "palpate/files.hpp"
#include "support/child_process.hpp"
#include "support/memory_limit.hpp"
#include "support/trials.hpp"

namespace palpate::hostile_file_test {

constexpr H5Z_filter_t filter_id = 40000;  // of nobody

// A file can lead to other files, which may be FIFOs or anything the user can read. None of them is
// opened.
class OutsideFile : public OneFile {
 protected:
  OutsideFile() {
    EXPECT_EQ(::mkfifo((folder_ / "fifo").c_str(), 0600), 0);
    // Something that could be taken for numbers, and a file with a dataset of the right shape.
    put_bytes(folder_ / "secret", std::string(24, 's'));
    recording_parts().save(folder_ / "other.h5");
  }

  // What reading says once `change` was made to a file without pressures names the dataset and the
  // word. Whoever opened the FIFO would wait for ever.
  void expect_refused(const char* word, const std::function<void(hid_t)>& change) const {
    recording_parts().without("pressure").save(path_);
    edit(path_, change);
    if (H5Zfilter_avail(filter_id) > 0) {
      H5Zunregister(filter_id);  // it was there to write the file
    }
    expect_named(refusal([&] { read_recording(path_); }), {"'pressure'", word});
  }

  std::string other(const char* name) const { return (folder_ / name).string(); }

  const Extents shape_{2, 3};
};

TEST_F(OutsideFile, ExternalStorageIsNotRead) {
  for (const char* name : {"fifo", "secret", "missing"}) {
    expect_refused("another file", [&](hid_t file) {
      const Hdf5Handle storage = storage_in({});
      H5Pset_external(storage.get(), other(name).c_str(), 0, 24);
      new_dataset(file, "pressure", H5T_NATIVE_FLOAT, space_of(shape_), storage.get());
    });
  }
}

TEST_F(OutsideFile, LinksAreNotFollowed) {
  for (const char* name : {"fifo", "other.h5", "missing"}) {
    const auto lead_away = [&](hid_t file, const char* object, const char* link) {
      H5Lcreate_external(other(name).c_str(), object, file, link, H5P_DEFAULT, H5P_DEFAULT);
    };
    expect_refused("link to another file",
                   [&](hid_t file) { lead_away(file, "/pressure", "pressure"); });
    // On the way of a link within the file.
    expect_refused("link", [&](hid_t file) {
      lead_away(file, "/", "away");
      H5Lcreate_soft("/away/pressure", file, "pressure", H5P_DEFAULT, H5P_DEFAULT);
    });
  }
  // libhdf5, which is not this process's alone, might follow it to another file.
  expect_refused("link", [](hid_t file) {
    H5Lcreate_soft("/elements", file, "pressure", H5P_DEFAULT, H5P_DEFAULT);
  });
  // A link of a kind that a program has made up.
  H5L_class_t kind{.version = H5L_LINK_CLASS_T_VERS,
                   .id = static_cast<H5L_type_t>(H5L_TYPE_UD_MIN + 36)};
  kind.trav_func = [](const char*, hid_t, const void*, size_t, hid_t, hid_t) -> hid_t {
    return H5I_INVALID_HID;
  };
  ASSERT_GE(H5Lregister(&kind), 0);
  expect_refused("link to another file", [&](hid_t file) {
    H5Lcreate_ud(file, "pressure", kind.id, "x", 1, H5P_DEFAULT, H5P_DEFAULT);
  });
  H5Lunregister(kind.id);
}

TEST_F(OutsideFile, VirtualDatasetsAreNotResolved) {
  for (const char* name : {"fifo", "other.h5", "missing"}) {
    for (const bool unlimited : {false, true}) {
      expect_refused("virtual", [&](hid_t file) {
        // Even the shape of an unlimited one is read from its sources.
        const hsize_t most[] = {unlimited ? H5S_UNLIMITED : 2, 3};
        const Hdf5Handle space = space_of(shape_, most);
        const hsize_t begin[] = {0, 0};
        const hsize_t one[] = {1, 1};
        H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, begin, nullptr, one, most);
        const Hdf5Handle storage = storage_in({});
        EXPECT_GE(H5Pset_virtual(storage.get(), space.get(), other(name).c_str(), "/pressure",
                                 space.get()),
                  0);
        new_dataset(file, "pressure", H5T_NATIVE_FLOAT, space_of(shape_, most), storage.get());
      });
    }
  }
}

// A file must not choose which code is loaded.
TEST_F(OutsideFile, FiltersAreNotLoaded) {
  // A FIFO among the plugins: whoever opens it waits.
  ASSERT_EQ(::mkfifo((folder_ / "libfilter.so").c_str(), 0600), 0);
  H5PLprepend(folder_.path().c_str());
  expect_refused("cannot be read", [&](hid_t file) {
    H5Z_class2_t filter{.version = H5Z_CLASS_T_VERS, .id = filter_id, .encoder_present = 1};
    filter.decoder_present = 1;
    filter.name = "test";
    filter.filter = [](unsigned, size_t, const unsigned*, size_t bytes, size_t*, void**) {
      return bytes;
    };
    ASSERT_GE(H5Zregister(&filter), 0);
    const Hdf5Handle storage = storage_in(shape_);
    H5Pset_filter(storage.get(), filter.id, H5Z_FLAG_MANDATORY, 0, nullptr);
    H5Pset_alloc_time(storage.get(), H5D_ALLOC_TIME_EARLY);
    new_dataset(file, "pressure", H5T_NATIVE_FLOAT, space_of(shape_), storage.get());
  });
  H5PLremove(0);
}

// What the caller has set up stays as it was.
TEST_F(OutsideFile, ExternalLinksAndPluginsStayAllowedElsewhere) {
  recording_parts().save(path_);
  unsigned before = 0;
  unsigned after = 0;
  H5PLget_loading_state(&before);
  EXPECT_EQ(read_recording(path_).pressure.size(), 6u);
  H5PLget_loading_state(&after);
  EXPECT_EQ(before, after);
  EXPECT_GT(H5Lis_registered(H5L_TYPE_EXTERNAL), 0);
}

constexpr std::uint64_t mib = 1 << 20;

// Adds a dataset of this float throughout, which is stored in far less than its size.
void add_constant(const std::filesystem::path& path, const char* name, const Extents& extents,
                  const Extents& chunk, float value) {
  edit(path, [&](hid_t file) {
    const Hdf5Handle storage = storage_in(chunk);
    H5Pset_fill_value(storage.get(), H5T_NATIVE_FLOAT, &value);
    H5Pset_alloc_time(storage.get(), H5D_ALLOC_TIME_EARLY);  // writes every chunk
    new_dataset(file, name, H5T_NATIVE_FLOAT, space_of(extents), storage.get());
  });
}

// Files that hold far more than their size on the disk says.
class LargeFile : public OneFile {
 protected:
  // Whether the work returns true in a process that may hold so much memory beyond what this one
  // holds already.
  static bool done_with_memory(std::uint64_t bytes, const std::function<bool()>& work) {
    std::uint64_t pages[6] = {};  // size, resident, shared, text, library, data
    std::ifstream statm("/proc/self/statm");
    for (std::uint64_t& field : pages) {
      statm >> field;
    }
    // Private writable memory, as RLIMIT_DATA counts it.
    const std::uint64_t held = pages[5] * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    return status_of([&] {
             limit_process(RLIMIT_DATA, held + bytes);
             ::_exit(work() ? 0 : 1);
           }) == 0;
  }
};

// 67 MB of cells and 42 MB of pressures.
TEST_F(LargeFile, IsSummarizedInPieces) {
  if (sanitized || !limits_memory()) {
    GTEST_SKIP() << "memory of processes is not limited here";
  }
  constexpr hsize_t edge = 1024;
  map_parts().without("log_odds").save(path_);
  add_constant(path_, "log_odds", {4 * edge, 4 * edge}, {edge, edge}, 0.0F);
  EXPECT_TRUE(done_with_memory(40 * mib, [&] {
    const MapSummary summary = summarize_map(path_);
    return summary.head.nx == 4096 && summary.occupied == 0 && summary.log_odds.most == 0.0;
  }));
  // What compresses by a factor of 1000 takes its time to read; a limit is for what is read.
  EXPECT_EQ(read_map(path_).log_odds.size(), 4096u * 4096u);
  constexpr hsize_t rows = 64 * 4096;
  constexpr hsize_t elements = 40;
  recording_parts()
      .attribute("rows", "frames")
      .without("pressure")
      .without("sensor_pose")
      .dataset("elements", {elements, 2})
      .save(path_);
  add_constant(path_, "pressure", {rows, elements}, {4096, elements}, 5.0F);
  add_constant(path_, "sensor_pose", {rows, 3}, {4096, 3}, 1.5F);
  EXPECT_TRUE(done_with_memory(20 * mib, [&] {
    const RecordingSurvey survey = survey_recording(path_);
    return survey.head.rows == rows && survey.pressure.in_contact == rows &&
           survey.with_pose == rows;
  }));
  EXPECT_FALSE(done_with_memory(20 * mib, [&] { return read_recording(path_).size() > 0; }))
      << "the limit holds";
}

// Rows may be longer than a piece, and chunks may lie across them.
TEST_F(LargeFile, PiecesComeInOrderWhateverTheChunks) {
  const Extents shape{3, 2, 700, 101};
  std::vector<double> values(3 * 2 * 700 * 101);
  for (std::size_t k = 0; k < values.size(); ++k) {
    values[k] = -static_cast<double>(k);
  }
  for (const Extents& chunk :
       {Extents{}, {3, 2, 700, 1}, {1, 1, 1, 101}, {2, 2, 300, 50}, {1, 2, 70, 9}}) {
    posterior_parts()
        .without("log_likelihood")
        .attribute("objects", std::vector<std::string>{"A", "B", "C"})
        .attribute("bins_theta", 2)
        .attribute("bins_y", 700)
        .attribute("bins_x", 101)
        .save(path_);
    edit(path_, [&](hid_t file) {
      put_values(new_dataset(file, "log_likelihood", H5T_NATIVE_DOUBLE, space_of(shape),
                             storage_in(chunk).get()),
                 H5T_NATIVE_DOUBLE, values.data());
    });
    EXPECT_TRUE(read_posterior(path_).log_likelihood == values);
    const PosteriorSummary summary = summarize_posterior(path_);
    ASSERT_EQ(summary.peaks.size(), 3u);
    EXPECT_EQ(summary.peaks[2].log_likelihood, values[2 * 2 * 700 * 101]);
    EXPECT_EQ(summary.peaks[2].bin, 0);
  }
}

}  // namespace palpate::hostile_file_test
