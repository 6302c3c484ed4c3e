// An HDF5 file can lead to other files, which may be FIFOs or anything the user can read. None of
// them is opened.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "file_parts.hpp"
#include "palpate/files.hpp"

namespace palpate::outside_file_test {

constexpr H5Z_filter_t filter_id = 40000;  // of nobody

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
  void expect_refused(const std::function<void(hid_t)>& change, const char* word) const {
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
    expect_refused(
        [&](hid_t file) {
          const Hdf5Handle storage = storage_in({});
          H5Pset_external(storage.get(), other(name).c_str(), 0, 24);
          new_dataset(file, "pressure", H5T_NATIVE_FLOAT, space_of(shape_), storage.get());
        },
        "another file");
  }
}

TEST_F(OutsideFile, LinksAreNotFollowed) {
  for (const char* name : {"fifo", "other.h5", "missing"}) {
    const auto lead_away = [&](hid_t file, const char* object, const char* link) {
      H5Lcreate_external(other(name).c_str(), object, file, link, H5P_DEFAULT, H5P_DEFAULT);
    };
    expect_refused([&](hid_t file) { lead_away(file, "/pressure", "pressure"); },
                   "link to another file");
    // On the way of a link within the file.
    expect_refused(
        [&](hid_t file) {
          lead_away(file, "/", "away");
          H5Lcreate_soft("/away/pressure", file, "pressure", H5P_DEFAULT, H5P_DEFAULT);
        },
        "link");
  }
  // libhdf5, which is not this process's alone, might follow it to another file.
  expect_refused(
      [](hid_t file) { H5Lcreate_soft("/elements", file, "pressure", H5P_DEFAULT, H5P_DEFAULT); },
      "link");
  // A link of a kind that a program has made up.
  H5L_class_t kind{.version = H5L_LINK_CLASS_T_VERS,
                   .id = static_cast<H5L_type_t>(H5L_TYPE_UD_MIN + 36)};
  kind.trav_func = [](const char*, hid_t, const void*, size_t, hid_t, hid_t) -> hid_t {
    return H5I_INVALID_HID;
  };
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
        H5Z_class2_t filter{.version = H5Z_CLASS_T_VERS, .id = filter_id, .encoder_present = 1};
        filter.decoder_present = 1;
        filter.name = "test";
        filter.filter = [](unsigned, size_t, const unsigned*, size_t bytes, size_t*, void**) {
          return bytes;
        };
        ASSERT_GE(H5Zregister(&filter), 0);
        const Hdf5Handle storage = storage_in({});
        H5Pset_chunk(storage.get(), 2, shape_.data());
        H5Pset_filter(storage.get(), filter.id, H5Z_FLAG_MANDATORY, 0, nullptr);
        const std::vector<float> values(6, 1.0F);
        put_values(new_dataset(file, "pressure", H5T_NATIVE_FLOAT, space_of(shape_), storage.get()),
                   H5T_NATIVE_FLOAT, values.data());
      },
      "cannot be read");
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

}  // namespace palpate::outside_file_test
