// An HDF5 file can lead to other files, which may be FIFOs or anything the user can read. None of
// them is opened.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "file_parts.hpp"
#include "palpate/files.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::outside_file_test {

constexpr H5Z_filter_t filter_id = 40000;  // of nobody

class OutsideFile : public testing::Test {
 protected:
  OutsideFile() {
    EXPECT_EQ(::mkfifo((folder_ / "fifo").c_str(), 0600), 0);
    // Something that could be taken for numbers, and a file with a dataset of the right shape.
    put_bytes(folder_ / "secret", std::string(24, 's'));
    recording_parts().save(folder_ / "other.h5");
    recording_parts().without("pressure").save(path_);
  }

  // What reading says once `change` was made to the file names the dataset and the word. Whoever
  // opened the FIFO would wait for ever.
  void expect_refused(const std::function<void(hid_t)>& change, const char* word) {
    recording_parts().without("pressure").save(path_);
    edit(path_, change);
    if (H5Zfilter_avail(filter_id) > 0) {
      H5Zunregister(filter_id);  // it was there to write the file
    }
    expect_named(input_error([&] { read_recording(path_); }), {path_.c_str(), "'pressure'", word});
  }

  static void create(hid_t file, hid_t creation, const hsize_t* most = nullptr) {
    const hsize_t extents[] = {2, 3};
    const Hdf5Handle space(H5Screate_simple(2, extents, most), H5Sclose);
    const Hdf5Handle dataset(H5Dcreate2(file, "pressure", H5T_NATIVE_FLOAT, space.get(),
                                        H5P_DEFAULT, creation, H5P_DEFAULT),
                             H5Dclose);
    EXPECT_TRUE(dataset.valid());
  }

  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "recording.h5";
};

TEST_F(OutsideFile, ExternalStorageIsNotRead) {
  for (const char* name : {"fifo", "secret", "missing"}) {
    expect_refused(
        [&](hid_t file) {
          const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
          H5Pset_external(creation.get(), (folder_ / name).c_str(), 0, 24);
          create(file, creation.get());
        },
        "another file");
  }
}

TEST_F(OutsideFile, ExternalLinksAreNotFollowed) {
  for (const char* name : {"fifo", "other.h5", "missing"}) {
    expect_refused(
        [&](hid_t file) {
          H5Lcreate_external((folder_ / name).c_str(), "/pressure", file, "pressure", H5P_DEFAULT,
                             H5P_DEFAULT);
        },
        "link to another file");
    // On the way of a link within the file.
    expect_refused(
        [&](hid_t file) {
          H5Lcreate_external((folder_ / name).c_str(), "/", file, "away", H5P_DEFAULT, H5P_DEFAULT);
          H5Lcreate_soft("/away/pressure", file, "pressure", H5P_DEFAULT, H5P_DEFAULT);
        },
        "link");
  }
}

TEST_F(OutsideFile, LinksOfOtherKindsAreNotFollowed) {
  const auto traverse = [](const char*, hid_t, const void*, size_t, hid_t, hid_t) -> hid_t {
    return H5I_INVALID_HID;
  };
  const H5L_class_t kind{H5L_LINK_CLASS_T_VERS,
                         static_cast<H5L_type_t>(H5L_TYPE_UD_MIN + 36),
                         "test",
                         nullptr,
                         nullptr,
                         nullptr,
                         traverse,
                         nullptr,
                         nullptr};
  ASSERT_GE(H5Lregister(&kind), 0);
  expect_refused(
      [&](hid_t file) {
        H5Lcreate_ud(file, "pressure", kind.id, "x", 1, H5P_DEFAULT, H5P_DEFAULT);
      },
      "link to another file");
  H5Lunregister(kind.id);
}

TEST_F(OutsideFile, VirtualDatasetsAreNotResolved) {
  for (const char* name : {"fifo", "other.h5", "missing"}) {
    for (const bool unlimited : {false, true}) {
      expect_refused(
          [&](hid_t file) {
            // Even the shape of an unlimited one is read from its sources.
            const hsize_t extents[] = {2, 3};
            const hsize_t most[] = {unlimited ? H5S_UNLIMITED : 2, 3};
            const Hdf5Handle space(H5Screate_simple(2, extents, most), H5Sclose);
            const hsize_t begin[] = {0, 0};
            const hsize_t one[] = {1, 1};
            const hsize_t block[] = {most[0], 3};
            H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, begin, nullptr, one, block);
            const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
            EXPECT_GE(H5Pset_virtual(creation.get(), space.get(), (folder_ / name).c_str(),
                                     "/pressure", space.get()),
                      0);
            create(file, creation.get(), most);
          },
          "virtual");
    }
  }
}

// A file must not choose which code is loaded.
TEST_F(OutsideFile, FiltersAreNotLoaded) {
  // A FIFO among the plugins: whoever opens it waits.
  ASSERT_EQ(::mkfifo((folder_ / "libfilter.so").c_str(), 0600), 0);
  H5PLprepend(folder_.path().c_str());
  expect_refused(
      [&](hid_t file) {
        const auto pass = [](unsigned, size_t, const unsigned*, size_t bytes, size_t*,
                             void**) -> size_t { return bytes; };
        const H5Z_class2_t filter{H5Z_CLASS_T_VERS, filter_id, 1,       1,
                                  "test",           nullptr,   nullptr, pass};
        ASSERT_GE(H5Zregister(&filter), 0);
        const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
        const hsize_t chunk[] = {2, 3};
        H5Pset_chunk(creation.get(), 2, chunk);
        H5Pset_filter(creation.get(), filter.id, H5Z_FLAG_MANDATORY, 0, nullptr);
        create(file, creation.get());
        const Hdf5Handle dataset(H5Dopen2(file, "pressure", H5P_DEFAULT), H5Dclose);
        const std::vector<float> values(6, 1.0F);
        EXPECT_GE(
            H5Dwrite(dataset.get(), H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
            0);
      },
      "cannot be read");
  H5PLremove(0);
}

// libhdf5, which is not this process's alone, might follow it to another file.
TEST_F(OutsideFile, SoftLinksAreNotFollowed) {
  expect_refused(
      [](hid_t file) { H5Lcreate_soft("/elements", file, "pressure", H5P_DEFAULT, H5P_DEFAULT); },
      "link");
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

}  // namespace palpate::outside_file_test
