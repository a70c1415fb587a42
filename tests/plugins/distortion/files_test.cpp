// SPDX-License-Identifier: Apache-2.0
// A distortion's own file, the key of a camera file, and XMALab's files.

#include <marrow/testing/node.hpp>

#include "marrow/toolbox/exchange/written_files.hpp"
#include "marrow/toolbox/exchange/xmalab_grid.hpp"
#include "marrow/toolbox/files/camera_file.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/write/writing.hpp"

namespace distortion_files_test {

using namespace marrow;
using namespace marrow::test;
using distortion::Distortion, distortion::PlatePoints;
using Eigen::Vector2d;
using node_test::call, node_test::item;
using DistortionFile = InAFolder;

/// 64 x 48 pixels; v is moved by 2 + 0.3 x y.
Distortion example() {
  Distortion d;
  d.width_px = 64;
  d.height_px = 48;
  d.degree = 2;
  d.terms_px.assign(6, Vector2d::Zero());
  d.terms_px[0] = {0, 2};
  d.terms_px[4] = {0, 0.3};
  d.area_px = {{4, 4}, {60, 4}, {60, 44}, {4, 44}};
  d.residual_px = 0.1;
  d.validated_px = 0.125;
  return d;
}

const std::string kCamera = R"(marrow-camera: 1
width_px: 64
height_px: 48
intrinsics: [[500, 0, 31.5], [0, 500, 23.5], [0, 0, 1]]
camera_from_world: {target: camera, source: world, matrix: [[1,0,0,0],[0,1,0,0],[0,0,1,600],[0,0,0,1]]}
)";

/// The distortion's text as the value of a key.
std::string below_key(const std::string& text) {
  std::string result = "distortion:\n  ";
  for (const char c : text) result += c == '\n' ? std::string("\n  ") : std::string(1, c);
  return result + "\n";
}

TEST_F(DistortionFile, IsReadBackAsItWasWritten) {
  Distortion local = example();
  local.step_px = 16;
  for (int i = 0; i < distortion::lattice_columns(local) * distortion::lattice_rows(local); ++i)
    local.lattice_px.emplace_back(0.01 * i, -0.02 * i);
  for (const Distortion& d : {example(), local}) {
    writing::write(d, folder / "d.yaml");
    EXPECT_EQ(hash_of(files::read_distortion_file(folder / "d.yaml")), hash_of(d));
  }
  const std::string text = bytes_of(folder / "d.yaml");
  expect_handled(folder, {"d.yaml", text, text.size(), {}, true}, files::read_distortion_file, {.as_text = true});
}

TEST_F(DistortionFile, SaysWhereItIsWrong) {
  expect_faults(folder / "d.yaml", files::distortion_text(example()),
                {{"degree: 2", "degree: 12", "degree: expected 0 to 9, got 12"},
                 {"degree: 2", "degree: 3", "terms_px"},
                 {"[0, 2]", "[0, .nan]", "terms_px"},
                 {"marrow-distortion: 1\n", "", "key 'marrow-distortion' is missing"},
                 {"marrow-distortion: 1", "marrow-distortion: 7", "reads version 1, the file is of version 7"},
                 {"width_px: 64", "width_px: 1", "expected 2 to 65536, got 1 and 48"},
                 {"[0, 0.3]", "[0, 4000]", "the distortion folds the image"}},
                files::read_distortion_file);
}

TEST_F(DistortionFile, ACameraFileHoldsOne) {
  const std::string key = below_key(files::distortion_text(example()));
  put(folder / "c.yaml", kCamera + key);
  const files::CameraInFile camera = files::read_camera_file(folder / "c.yaml");
  EXPECT_TRUE(camera.is_distorted());
  EXPECT_EQ(hash_of(camera.measured), hash_of(example()));
  put(folder / "c.yaml", kCamera + "radial_distortion: [1, 0, 0]\n" + key);
  EXPECT_SAYS(files::read_camera_file(folder / "c.yaml"), "'radial_distortion' is given, too; keep one of the two");
  put(folder / "c.yaml", with(kCamera, "width_px: 64", "width_px: 80") + key);
  EXPECT_SAYS(files::read_camera_file(folder / "c.yaml"), "it is of images of 64 x 48 pixels, the camera of 80 x 48");
}

/// Grey values that grow by 10 a row.
cv::Mat ramp() {
  cv::Mat image(48, 64, CV_16U);
  for (int v = 0; v < 48; ++v) image.row(v).setTo(1000 + 10 * v);
  return image;
}

/// At ideal (31.5, 23.5) the image is seen 2 px below, so 20 grey values brighter.
void expect_straight(const View& view) {
  EXPECT_NEAR(view.image.pixels.at<std::uint16_t>(24, 32), 1000 + 240 + 20, 1);
  EXPECT_EQ(view.mask.at<std::uint8_t>(24, 32), 255);
  EXPECT_EQ(view.mask.at<std::uint8_t>(24, 2), 0);
  EXPECT_EQ(view.camera.intrinsics(0, 2), 31.5);
}

TEST_F(DistortionFile, AViewIsStraightenedWhenItIsRead) {
  writing::write(Image{ramp()}, folder / "v.png");
  put(folder / "c.yaml", kCamera);
  writing::write(example(), folder / "d.yaml");
  put(folder / "both.yaml", kCamera + below_key(files::distortion_text(example())));
  const auto read = [&](const std::string& camera, const std::string& distortion) {
    node_test::Options options{{"image", (folder / "v.png").string()}, {"camera", (folder / camera).string()}};
    if (!distortion.empty()) options["distortion"] = (folder / distortion).string();
    return call("read.view", {}, options).at("view").as<View>();
  };
  expect_straight(read("c.yaml", "d.yaml"));
  expect_straight(read("both.yaml", ""));
  EXPECT_SAYS(read("both.yaml", "d.yaml"), "give a distortion, which can be removed only once");
  const View view{"v", {ramp()}, files::read_camera_file(folder / "c.yaml").camera, {}};
  expect_straight(
      call("camera.straighten", {{"view", item(view)}, {"distortion", item(example())}}).at("view").as<View>());
}

PlatePoints grid_points() {
  PlatePoints points;
  points.width_px = 640;
  points.height_px = 480;
  for (int v = 20; v < 470; v += 25)
    for (int u = 20; u < 630; u += 25) {
      const Vector2d ideal(u, v), off = (ideal - Vector2d(319.5, 239.5)) / 320;
      points.add(ideal, ideal + 9 * off.squaredNorm() * off + 2 * off.squaredNorm() * Vector2d(-off.y(), off.x()));
    }
  points.used[7] = 0;
  return points;
}

const std::string kXmalabCamera = R"(image size
640,480

camera matrix
1000,0,320
0,1000,240
0,0,1

rotation
1,0,0
0,1,0
0,0,1

translation
0
0
900
)";

struct XmalabFolder : TemporaryFolder {
  XmalabFolder() {
    const auto written = call("write.xmalab", {{"points", item(grid_points())}});
    for (const std::string name : {"distorted", "references", "inlier"})
      put(*this / (name + ".csv"), written.at(name).as<exchange::XmalabGridFile>().bytes);
    put(*this / "camera.txt", kXmalabCamera);
  }
  node_test::Options options() const {
    return {{"camera", (*this / "camera.txt").string()},
            {"distorted", (*this / "distorted.csv").string()},
            {"references", (*this / "references.csv").string()},
            {"inlier", (*this / "inlier.csv").string()}};
  }
};

TEST(XmalabGrid, IsReadBackAndFitted) {
  const XmalabFolder folder;
  EXPECT_EQ(test::bytes_of(folder / "references.csv").substr(0, 15), "20, 20\n45, 20\n7");
  EXPECT_EQ(test::bytes_of(folder / "inlier.csv").substr(0, 18), "1\n1\n1\n1\n1\n1\n1\n0\n1\n");
  const auto points = call("read.xmalab_grid", {}, folder.options()).at("points");
  EXPECT_EQ(hash_of(points.as<PlatePoints>()), hash_of(grid_points()));
  const auto fit = call("camera.distortion_points", {{"points", points}});
  const auto& found = fit.at("distortion").as<Distortion>();
  EXPECT_LT(found.validated_px, 1e-8);
  for (std::size_t i = 0; i < grid_points().used.size(); ++i)
    EXPECT_LT((seen_pixel(found, grid_points().ideal_px[i]) - grid_points().seen_px[i]).norm(), 1e-7);
}

/// OpenCV's model, by hand: x_seen = x (1 + k1 r2) + 2 p1 x y + p2 (r2 + 2 x2), and y alike.
TEST(XmalabGrid, ParametersComeAfterTheGrid) {
  const XmalabFolder folder;
  const double k1 = 0.8, p1 = 0.01, p2 = -0.02;
  put(folder / "p.csv", "0.8\n0\n0.01\n-0.02\n0\n0\n0\n0\n");
  node_test::Options options = folder.options();
  options["parameters"] = (folder / "p.csv").string();
  const auto with_grid = call("read.xmalab_grid", {}, options).at("points").as<PlatePoints>();
  options.erase("distorted");
  options.erase("references");
  options.erase("inlier");
  const auto alone = call("read.xmalab_grid", {}, options).at("points").as<PlatePoints>();
  const auto bent = [&](const Vector2d& ideal) {
    const double x = (ideal.x() - 320) / 1000, y = (ideal.y() - 240) / 1000, r2 = x * x + y * y;
    return Vector2d(320 + 1000 * (x * (1 + k1 * r2) + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)),
                    240 + 1000 * (y * (1 + k1 * r2) + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y));
  };
  ASSERT_EQ(with_grid.used.size(), grid_points().used.size());
  for (std::size_t i = 0; i < with_grid.used.size(); ++i) {
    EXPECT_LT((bent(with_grid.ideal_px[i]) - grid_points().ideal_px[i]).norm(), 1e-3);
    EXPECT_EQ(with_grid.seen_px[i], grid_points().seen_px[i]);
  }
  EXPECT_EQ(alone.used.size(), 41u * 41u);
  for (std::size_t i = 0; i < alone.used.size(); ++i)
    EXPECT_LT((bent(alone.ideal_px[i]) - alone.seen_px[i]).norm(), 1e-3);
}

TEST(XmalabGrid, SaysWhatIsWrong) {
  const XmalabFolder folder;
  const auto says = [&](const node_test::Options& options, const std::string& said) {
    EXPECT_SAYS(call("read.xmalab_grid", {}, options), said);
  };
  put(folder / "distorted.csv", "1, 2\n3, x\n");
  says(folder.options(), "distorted.csv:2: expected two numbers, u and v in pixels, got '3, x'");
  put(folder / "distorted.csv", "1, 2\n\n3, 4\n");
  says(folder.options(), "the files must be of one grid");
  put(folder / "distorted.csv", "\n");
  says(folder.options(), "distorted.csv: there is no number in it");
  node_test::Options options = folder.options();
  options.erase("references");
  says(options, "'distorted' and 'references' belong together");
  put(folder / "p.csv", "1\n2\n");
  says({{"camera", (folder / "camera.txt").string()}, {"parameters", (folder / "p.csv").string()}},
       "p.csv: expected the 8 numbers k1, k2, p1, p2, k3, k4, k5, k6, one a line, got 2");
}

TEST(XmalabGrid, ACameraIsReadBackAsItWasWritten) {
  const XmalabFolder folder;
  const Camera camera = files::read_camera_file(folder / "camera.txt").camera;
  const auto written = call("write.xmalab", {{"camera", item(camera)}});
  EXPECT_TRUE(written.at("distorted").is_absent());
  EXPECT_EQ(written.at("camera_file").as<exchange::XmalabCameraFile>().bytes, kXmalabCamera);
}

}  // namespace distortion_files_test
