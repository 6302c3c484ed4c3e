#include "palpate/files.hpp"

#include <gtest/gtest.h>

#include "file_parts.hpp"
#include "palpate/touch.hpp"
#include "support/host_locale.hpp"

namespace palpate::scene_test {

class SceneFile : public OneFile {
 protected:
  SceneFile() : OneFile("scene.yaml") {}

  Scene read(const std::string& yaml) const {
    put_bytes(path_, yaml);
    return read_scene(path_);
  }
  std::string message(const std::string& yaml) const {
    return refusal([&] { read(yaml); });
  }

 private:
  HostLocale locale_;  // a program's own reads no number that others do not
};

using Options = std::map<std::string, std::string>;

TEST_F(SceneFile, SaysAllThatItCan) {
  const Scene scene = read(R"(
array: digitacts
sensor_model: s.yaml
threshold: 2.500
ratio: +0.25
gamma: 0.05
prior: 0.15
objects:
  - {map: A.map.h5, label: A, symmetry: 0, mirror: true, weight: 2}
  - {map: /maps/E.map.h5}
region: {x_mm: [-10, 20], y_mm: [-1, 1], theta_deg: [0, 90], pivot_mm: [400, -5]}
bins: [25, 24, 16]
filter: particles
device: llvmpipe
touch_sd: {mm: 1, deg: 3}
slip_sd: {deg: 0.5}
none: auto
)");
  EXPECT_EQ(scene.array_mm, digitacts_array());
  ASSERT_EQ(scene.objects.size(), 2u);
  EXPECT_EQ(scene.objects[0].map, folder_ / "A.map.h5");
  EXPECT_EQ(scene.objects[0].label, "A");
  EXPECT_EQ(scene.objects[0].symmetry, 0);
  EXPECT_EQ(scene.objects[0].mirror, true);
  EXPECT_EQ(scene.objects[0].weight, 2.0);
  EXPECT_EQ(scene.objects[1].map, "/maps/E.map.h5");
  const Scene::Object& bare = scene.objects[1];
  EXPECT_FALSE(bare.label || bare.symmetry || bare.mirror);
  EXPECT_EQ(scene.objects[1].weight, 1.0);
  EXPECT_EQ(scene.options, (Options{{"sensor-model", (folder_ / "s.yaml").string()},
                                    {"threshold", "2.500"},
                                    {"ratio", "+0.25"},
                                    {"gamma", "0.05"},
                                    {"prior", "0.15"},
                                    {"x-mm", "-10:20"},
                                    {"y-mm", "-1:1"},
                                    {"theta-deg", "0:90"},
                                    {"pivot-mm", "400,-5"},
                                    {"bins", "25x24x16"},
                                    {"filter", "particles"},
                                    {"device", "llvmpipe"},
                                    {"touch-sd-mm", "1"},
                                    {"touch-sd-deg", "3"},
                                    {"slip-sd-deg", "0.5"},
                                    {"none", "auto"}}));
}

TEST_F(SceneFile, MayLeaveEverythingOut) {
  for (const char* yaml : {"", "# nothing but a comment\n", "{}"}) {
    const Scene scene = read(yaml);
    EXPECT_TRUE(scene.options.empty() && scene.objects.empty());
    EXPECT_FALSE(scene.array_mm);
  }
}

TEST_F(SceneFile, TakesWordsAndTextsAsFlagsHaveThem) {
  EXPECT_EQ(read("bins: fine\nregion: {pivot_mm: auto, x_mm: '-1:2'}").options,
            (Options{{"bins", "fine"}, {"pivot-mm", "auto"}, {"x-mm", "-1:2"}}));
  // A leading 0 is no octal number: --bins reads it like this, too.
  EXPECT_TRUE(read("bins: [010, 08, +8]").options.contains("bins"));
  EXPECT_EQ(read("objects: [{map: A.h5, symmetry: 010}]").objects[0].symmetry, 10);
}

TEST_F(SceneFile, TakesTheArrayAsAListOrFromAFileBesideIt) {
  EXPECT_EQ(read("array: [[0, 1], [2.5, -3]]").array_mm,
            (std::vector<glm::dvec2>{{0, 1}, {2.5, -3}}));
  const std::string pads = (folder_ / "pads.txt").string();
  put_bytes(pads, "# two pads\n\n-1 0.5 # left\r\n\t1.5e0\t-2\n");
  EXPECT_EQ(read("array: pads.txt").array_mm, (std::vector<glm::dvec2>{{-1, 0.5}, {1.5, -2}}));
  // Csv has all that is no row.
  for (const auto& [text, place] :
       {std::pair{"1 2\n3\n", ":2:"}, {"1 2\nnan 1\n", ":2:"}, {"# none\n", "holds no row"}}) {
    put_bytes(pads, text);
    expect_named(input_error([&] { read("array: pads.txt"); }), {pads.c_str(), place});
  }
  expect_named(input_error([&] { read("array: digitact"); }), {"digitact", "no such file"});
}

TEST_F(SceneFile, NamesKeysThatItDoesNotKnow) {
  expect_named(message("ratio: 0.3\ntreshold: 2"), {"line 2", "treshold", "unknown", "threshold"});
  expect_named(message("region:\n  x: [0, 1]"), {"line 2", "'x'", "unknown", "x_mm"});
  expect_named(message("objects:\n  - {map: A.h5, name: A}"), {"line 2", "name", "label"});
  expect_named(message("[a]: 1"), {"line 1", "unknown"});
  expect_named(message("ratio: 0.3\nratio: 0.2"), {"line 2", "ratio", "twice"});
}

TEST_F(SceneFile, NamesValuesThatItCannotTake) {
  const std::pair<const char*, std::vector<const char*>> keys[] = {
      {"threshold", {"high", "-1", ".nan", ".inf", "2 kPa", "1,5", "1.500,25", "[2]", ""}},
      {"ratio", {"1"}},
      {"gamma", {"1", "-0.1"}},
      {"prior", {"0", "1"}},
      {"array", {"[]", "{}"}},
      {"objects", {"A.h5"}},
      {"region", {"10"}},
      {"bins",
       {"[25, 25]", "[25, 25, 0]", "[25, 2.5, 16]", "[0x10, 1, 1]", "[1e1, 1, 1]", "[1.0, 1, 1]",
        "[1.000, 1, 1]", "[2147483648, 1, 1]", "[' 1', 1, 1]", "coarse"}},
      {"sensor_model", {"[s.yaml]"}},
      {"filter", {"kalman"}},
      {"device", {"[0]"}}};
  for (const auto& [key, values] : keys) {
    for (const std::string value : values) {
      expect_named(message(key + (": " + value)), {"line 1", key});
    }
  }
  for (const auto& [yaml, key] : {std::pair{"array: [1, 2]", "array[0]"},
                                  {"array: [[1, 2], [1, x]]", "array[1][1]"},
                                  {"objects: [A.h5]", "objects[0]"},
                                  {"objects: [{label: A}]", "map"},
                                  {"objects: [{map: A.h5, symmetry: -1}]", "symmetry"},
                                  {"objects: [{map: A.h5, symmetry: 1.5}]", "symmetry"},
                                  {"objects: [{map: A.h5, weight: 0}]", "weight"},
                                  {"objects: [{map: A.h5, mirror: 1}]", "mirror"},
                                  {"objects: [{map: A.h5, label: ''}]", "label"},
                                  {"region: {x_mm: [10, -10]}", "x_mm"},
                                  {"region: {y_mm: [0]}", "y_mm"},
                                  {"region: {pivot_mm: [0, .nan]}", "pivot_mm"},
                                  {"region: {pivot_mm: here}", "pivot_mm"},
                                  {"- ratio: 0.3", "the scene"}}) {
    expect_named(message(yaml), {"line 1", key});
  }
}

TEST_F(SceneFile, IsOneDocumentOfYaml) {
  for (const char* yaml : {"---\nratio: 0.3\n...\n", "\xEF\xBB\xBF# c\n---\nratio: 0.3\n...\n...\n",
                           "\xEF\xBB\xBF\n---\nratio: 0.3\n"}) {
    EXPECT_EQ(read(yaml).options.at("ratio"), "0.3") << yaml;
  }
  expect_named(message("ratio: 0.3\n---\nbins: auto"), {"line 2", "second document"});
  expect_named(message("ratio: 0.3\n...\n\nbins: auto"), {"line 4", "second document"});
  const std::u16string wide = u"\uFEFFratio: 0.3\n---\nbins: auto";
  expect_named(message({reinterpret_cast<const char*>(wide.data()), 2 * wide.size()}),
               {"line 2", "second document"});
  expect_named(message("ratio: 0.3\nobjects: [1, 2\nbins: 3"), {"line", "YAML"});
  expect_named(input_error([&] { read_scene(folder_ / "no.yaml"); }), {"no.yaml", "no such file"});
}

TEST_F(SceneFile, IsReadOrRefusedByNameWhereverItIsCutShort) {
  const std::string whole =
      "array: [[0, 1], [2, 3]]\nthreshold: 2.0\nobjects:\n  - {map: A.h5, label: A, weight: 1.0}\n"
      "region: {x_mm: [-10, 10], theta_deg: [0, 360]}\nbins: [25, 25, 16]\nfilter: histogram\n";
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    SCOPED_TRACE(size);
    try {
      read(whole.substr(0, size));
    } catch (const Error& error) {
      expect_named(error.what(), {path_.c_str()});
    }
  }
}

}  // namespace palpate::scene_test
