// A hostile publisher: sends random clouds, transforms, calls and settings of every kind in hostile/ to the
// nodelet in this process. Nothing crashes or hangs, memory is bounded, every cloud is counted under a reason
// that its kind allows, every refusal has a message, and afterwards the mapper maps like a new one.
//
// BKI_MAPPING_HOSTILE_SEED: seed (default 1). BKI_MAPPING_HOSTILE_MESSAGES: minimum number of messages
// (default 2000), or BKI_MAPPING_HOSTILE_SECONDS: duration. BKI_MAPPING_HOSTILE_SETTINGS: use only this set
// of settings. BKI_MAPPING_HOSTILE_JOURNAL: file to which the kind of each message is written before it is
// sent.
#include <bki_mapping/BoundingBoxQuery.h>
#include <bki_mapping/MappingStatus.h>
#include <bki_mapping/SaveMap.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <dynamic_reconfigure/config_tools.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>
#include <sys/stat.h>
#include <tf2_msgs/TFMessage.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <utility>

#include "hostile/kinds.h"
#include "hostile/settings.h"
#include "hostile/watchers.h"
#include "ros/point_account.h"
#include "ros/scan_ledger.h"
#include "temporary_folder.h"

namespace bki_mapping::ros_interface {
namespace {

using namespace bki_mapping::hostile;
using sensor_msgs::PointCloud2;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;  // sanitizers keep freed memory, and need shadow memory
#else
constexpr bool kSanitized = false;
#endif
/// Maximum resident memory [MB]. If a pose is far off, a grid from above grows to 256 MB
/// (ColumnPublisher::fits) until the map is reset; if it is published before that, the publisher has it
/// twice, and the listener once.
constexpr double kMaxMemory = 1000.0;

std::string environment(const char* name, const std::string& standard) {
  const char* text = std::getenv(name);
  return text ? text : standard;
}

/// Resident memory of this process [MB].
double residentMemory() {
  std::ifstream in("/proc/self/statm");
  double pages = 0.0;
  in >> pages >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE)) * 1e-6;
}

/// The results of a run.
struct Results {
  std::map<std::string, std::map<std::string, std::size_t>> answers;  ///< count by kind and answer
  std::map<std::string, std::size_t> tried;
  std::map<std::string, double> seconds;         ///< time taken by each kind
  std::map<std::string, std::string> sentences;  ///< example for each kind and answer
  std::size_t messages = 0;
  double most_memory = 0.0;
};

/// One mapper under one set of settings, from loading it to comparing it with a fresh one.
class Attack {
 public:
  Attack(ros::NodeHandle& node, Mapper& mapper, LogReader& log, Watchdog& watchdog, Results& results,
         const Settings& settings, std::uint64_t seed)
      : mapper_(mapper),
        log_(log),
        watchdog_(watchdog),
        results_(results),
        settings_(settings),
        seed_(seed),
        dice_(seed),
        listeners_(node),
        journal_(open(environment("BKI_MAPPING_HOSTILE_JOURNAL", "/dev/null").c_str(),
                      O_WRONLY | O_CREAT | O_APPEND, 0644)) {
    for (const char* topic : {"/hostile_cloud", "/hostile_cloud_2"}) {
      clouds_.push_back(node.advertise<PointCloud2>(topic, 1000));
    }
    paths_ = node.advertise<nav_msgs::Path>("/corrected_path", 10);
    transforms_ = node.advertise<tf2_msgs::TFMessage>("/tf", 1000);
    static_transforms_ = node.advertise<tf2_msgs::TFMessage>("/tf_static", 1000);
    for (const char letter : settings.name)
      dice_ = Dice(31 * dice_.bits() + static_cast<unsigned char>(letter));
    inputs_ = settings.values.count("inputs/rear/topic") > 0 ? 2 : 1;
    points_have_times_ =
        settings.values.count("time_field") + settings.values.count("inputs/front/time_field") > 0;
  }
  ~Attack() { close(journal_); }

  /// Sends every kind `rounds` times, and then checks that the mapper works as before.
  void run(std::size_t rounds) {
    load();
    for (std::size_t round = 0; round < rounds; ++round) {
      for (const auto& send : shuffledKinds()) {
        send();
        if (testing::Test::HasFatalFailure()) return;
      }
    }
    mapsAsEver();
    checkSentences();
    mapper_.unload();
  }

  /// Sends the given number of messages with 200 new frames each, and waits for them. @return memory [MB].
  double floodFrames(int messages) {
    if (sent_ == 0) load();
    begin("flood");
    for (int n = 0; n < messages; ++n) {
      const std::string frame = "flood_" + std::to_string(sent_) + "_" + std::to_string(n);
      TransformKind::Message message{false, {}};
      for (int k = 0; k < 200; ++k) {
        message.transforms.push_back(honestTransform("map", frame + "_" + std::to_string(k), nextStamp()));
      }
      publish({message});
    }
    publish(changedCloud(cloudKinds().front()));
    expectAnswer({"mapped"});
    return residentMemory();
  }

 private:
  std::string where() const {
    return "settings " + settings_.name + ", seed " + std::to_string(seed_) + ", message " +
           std::to_string(number_) + ", " + kind_;
  }

  void begin(const std::string& kind) {
    const Clock::time_point now = Clock::now();
    results_.seconds[kind_] += std::chrono::duration<double>(now - begun_).count();
    begun_ = now;
    kind_ = kind;
    ++number_;
    ++results_.messages;
    ++results_.tried[kind];
    const double memory = residentMemory();
    const std::string line = where() + ", before it " + std::to_string(std::lround(memory)) + " MB\n";
    if (write(journal_, line.data(), line.size()) < 0) ADD_FAILURE() << "the journal cannot be written";
    watchdog_.feed(where());
    results_.most_memory = std::max(results_.most_memory, memory);
    EXPECT_LT(memory, kMaxMemory) << where();
  }

  void load() {
    watchdog_.feed("loading: " + where());
    refusals_before_ = log_.refusals();
    mapper_.load(settings_);
    sent_ = 0;
    before_ = MappingStatus();
    dynamic_reconfigure::Reconfigure ask;
    ASSERT_TRUE(mapper_.call("reconfigure/set_parameters", ask));
    original_ = ask.response.config;
    const auto connected = [this] {
      for (std::size_t i = 0; i < inputs_; ++i) {
        if (clouds_[i].getNumSubscribers() == 0) return false;
      }
      return transforms_.getNumSubscribers() > 0 && (!isCorrected() || paths_.getNumSubscribers() > 0);
    };
    const auto end = Clock::now() + std::chrono::duration<double>(kLongestAnswer);
    while (!connected() && Clock::now() < end) ros::WallDuration(0.005).sleep();
    ASSERT_TRUE(connected());
  }

  // --- what is sent ---

  ros::Time nextStamp() {
    ++turn_;
    return ros::Time(1000.0) + ros::Duration(0.1 * static_cast<double>(turn_));
  }

  void publish(const std::vector<TransformKind::Message>& messages) {
    for (const auto& message : messages) {
      const boost::shared_ptr<tf2_msgs::TFMessage> out(new tf2_msgs::TFMessage);
      out->transforms = message.transforms;
      (message.is_static ? static_transforms_ : transforms_).publish(out);
    }
  }
  void publishHonestTransforms(const ros::Time& stamp) {
    const double x = 0.05 * static_cast<double>(turn_ % 100);
    std::vector<geometry_msgs::TransformStamped> all;
    for (const double later : {0.0, 0.15}) {
      const ros::Time time = stamp + ros::Duration(later);
      all.push_back(honestTransform("map", "honest_base", time, x + later));
      all.push_back(honestTransform("honest_base", "honest_sensor", time, 0.5));
    }
    publish({{false, all}});
  }
  void publish(const PointCloud2& cloud) {
    ++sent_;
    clouds_[dice_.below(inputs_)].publish(boost::shared_ptr<PointCloud2>(new PointCloud2(cloud)));
  }

  /// Waits for the mapper's answer to the last cloud, and returns it.
  void wait(std::string& answer) {
    MappingStatus now;
    ASSERT_TRUE(mapper_.settle(sent_, now)) << "no answer: " << where() << "\n" << now;
    answer = now.integrated > before_.integrated ? "mapped" : "none";
    for (const DropKind& kind : dropKinds()) {
      if (now.*kind.count == before_.*kind.count) continue;
      answer = kind.name;
      results_.sentences[kind_ + ": " + answer] = now.last_drop;
    }
    before_ = now;
    ++results_.answers[kind_][answer];
  }
  std::string answer() {
    std::string answer = "none";
    wait(answer);
    return answer;
  }
  void expectAnswer(Answers allowed) {
    const std::string given = answer();
    allowed.insert(allowed.end(), {"memory limit", "too large"});  // allowed by the settings
    EXPECT_TRUE(std::find(allowed.begin(), allowed.end(), given) != allowed.end())
        << where() << ": was answered with '" << given << "'";
  }

  PointCloud2 changedCloud(const CloudKind& kind) {
    const ros::Time stamp = nextStamp();
    publishHonestTransforms(stamp);
    PointCloud2 cloud = honestCloud("honest_sensor", stamp, dice_);
    kind.change(cloud, dice_);
    return cloud;
  }
  void send(const CloudKind& kind) {
    begin(kind.name);
    publish(changedCloud(kind));
    expectAnswer(kind.answers);
  }
  void send(const TransformKind& kind) {
    begin(kind.name);
    const ros::Time stamp = nextStamp();
    publishHonestTransforms(stamp);
    const std::string frame = "frame_" + std::to_string(results_.messages);
    publish(kind.make(frame, stamp, dice_));
    publish(honestCloud(frame, stamp, dice_));
    Answers allowed = kind.answers;
    if (points_have_times_) {  // this kind sends no transforms for these times
      allowed.insert(allowed.end(), {"transform late", "too old"});
    }
    expectAnswer(allowed);
  }
  void send(const PathKind& kind) {
    begin(kind.name);
    SaveMap save;
    save.request.path = kind.make(folder_ / ".");
    save.request.include = "occupied,free,occluded";
    struct stat before {};
    const bool there = stat(save.request.path.c_str(), &before) == 0;
    ASSERT_TRUE(mapper_.call("save_map", save)) << where();
    ++results_.answers[kind.name][save.response.success ? "written" : "refused"];
    EXPECT_EQ(save.response.success, kind.written) << where() << ": " << save.response.message;
    EXPECT_GT(save.response.message.size(), 10u) << where();
    struct stat after {};
    if (there && !S_ISREG(before.st_mode)) {
      EXPECT_EQ(stat(save.request.path.c_str(), &after), 0) << where();
      EXPECT_EQ(after.st_mode & S_IFMT, before.st_mode & S_IFMT) << where() << ": the node was replaced";
    }
  }
  void send(const SettingsKind& kind) {
    begin(kind.name);
    dynamic_reconfigure::Reconfigure change;
    kind.change(change.request.config, dice_);
    ASSERT_TRUE(mapper_.call("reconfigure/set_parameters", change)) << where();
    std::string refusal;
    dynamic_reconfigure::ConfigTools::getParameter(change.response.config, "last_refusal", refusal);
    ++results_.answers[kind.name][refusal.empty() ? "applied" : "refused"];
    if (kind.refused) {
      EXPECT_GT(refusal.size(), 20u) << where();
    }
    EXPECT_LT(refusal.size(), 3000u) << where();
    // Applied settings must be able to map at least a small cloud.
    const ros::Time stamp = nextStamp();
    publishHonestTransforms(stamp);
    PointCloud2 cloud = honestCloud("honest_sensor", stamp, dice_);
    cloud.height = 1;
    cloud.width = std::min(cloud.width, 3u);
    publish(cloud);
    expectAnswer({"mapped"});
    if (kind.name != "settings/allowed" || dice_.oneIn(2)) restoreSettings();
  }
  void restoreSettings() {
    dynamic_reconfigure::Reconfigure back;
    back.request.config = original_;
    ASSERT_TRUE(mapper_.call("reconfigure/set_parameters", back)) << where();
  }

  void send(const QueryKind& kind) {
    begin(kind.name);
    const QueryKind::Answer answer = kind.ask(kName, dice_);
    ASSERT_TRUE(answer.called) << where();
    ++results_.answers[kind.name][answer.success ? "answered" : "refused"];
    EXPECT_EQ(answer.success, kind.answered) << where() << ": " << answer.message;
    if (answer.success) {
      EXPECT_EQ(answer.message, "") << where();
      return;
    }
    EXPECT_EQ(answer.entries, 0u) << where();
    EXPECT_GE(answer.message.size(), kShortestText) << where() << ": " << answer.message;
    EXPECT_LE(answer.message.size(), kLongestText) << where();
  }

  bool isCorrected() const { return settings_.values.count("journal") > 0; }
  void send(const CorrectionKind& kind) {
    begin(kind.name);
    callEmpty("reset");            // forgets the frames of other clouds, of which the path cannot be
    for (int n = 0; n < 3; ++n) {  // among which the poses are
      publish(changedCloud(cloudKinds().front()));
      expectAnswer({"mapped"});
    }
    const std::uint64_t before = before_.corrections + before_.corrections_refused;
    const std::uint64_t refused = before_.corrections_refused;
    const ros::Time stamp = ros::Time(1000.0) + ros::Duration(0.1 * static_cast<double>(turn_));
    paths_.publish(boost::shared_ptr<nav_msgs::Path>(new nav_msgs::Path(kind.make(stamp, dice_))));
    ASSERT_TRUE(mapper_.settlePaths(before + 1, before_)) << where() << "\n" << before_;
    const bool used = before_.corrections_refused == refused;
    ++results_.answers[kind.name][used ? "used" : "refused"];
    EXPECT_EQ(used, kind.used) << where() << ": " << before_.last_correction_refusal;
    if (used) return;
    EXPECT_GE(before_.last_correction_refusal.size(), kShortestText) << where();
    EXPECT_LE(before_.last_correction_refusal.size(), kLongestText) << where();
  }

  void send(const DeedKind& kind) {
    begin(kind.name);
    if (kind.name == "deed/two_wrongs") return twoWrongs();
    if (kind.name == "deed/burst") return burst();
    if (kind.name == "deed/transform_after") return transformAfter();
    if (kind.name == "deed/time_back") return timeBack();
    if (kind.name == "deed/pause") return pause();
    if (kind.name == "deed/reset") return callEmpty("reset");
    if (kind.name == "deed/publish_map") return callEmpty("publish_map");
    if (kind.name == "deed/include") return include();
    if (kind.name == "deed/clear_box") return clearBox();
    if (kind.name == "deed/listeners") return listeners_.change(dice_);
    if (kind.name == "deed/reload") return reload();
    ADD_FAILURE() << kind.name << " is not done";
  }
  void twoWrongs() {
    PointCloud2 cloud = changedCloud(dice_.oneOf(cloudKinds()));
    if (!cloud.fields.empty() && !cloud.data.empty() && cloud.width > 0 && cloud.height > 0) {
      for (int n = 0; n < 2 && cloud.fields.size() > 3; ++n) {
        const CloudKind& other = dice_.oneOf(cloudKinds());
        if (other.name.compare(0, 5, "size/") == 0 || other.name.compare(0, 7, "header/") == 0) {
          other.change(cloud, dice_);
          break;
        }
      }
    }
    publish(cloud);
    answer();
  }
  void burst() {
    for (int n = 0; n < 30; ++n) publish(changedCloud(dice_.oneOf(cloudKinds())));
    answer();
  }
  void transformAfter() {
    const ros::Time stamp = nextStamp();
    publish(honestCloud("honest_sensor", stamp, dice_));
    publishHonestTransforms(stamp);
    expectAnswer({"mapped", "transform late"});  // late on a slow machine
  }
  void timeBack() {
    const auto drive = [this] {  // several clouds that agree on the time
      for (int n = 0; n < 3; ++n) {
        publish(changedCloud(cloudKinds().front()));
        answer();
      }
    };
    drive();
    turn_ = turn_ > 1000 ? turn_ - 1000 : 0;
    drive();
  }
  void pause() {
    std_srvs::Trigger service;
    EXPECT_TRUE(mapper_.call("pause", service) && service.response.success) << where();
    publish(changedCloud(dice_.oneOf(cloudKinds())));
    expectAnswer({"paused"});
    EXPECT_TRUE(mapper_.call("resume", service) && service.response.success) << where();
  }
  void callEmpty(const std::string& name) {
    std_srvs::Empty service;
    EXPECT_TRUE(mapper_.call(name, service)) << where();
  }
  void include() {
    SaveMap save;
    save.request.path = folder_ / "included.ply";
    std::string many;
    for (int n = 0; n < 100000; ++n) many += "occupied,";
    save.request.include =
        dice_.oneOf<std::string>({"occupied", ",", "nothing", many, std::string("free\0", 5)});
    EXPECT_TRUE(mapper_.call("save_map", save)) << where();
    EXPECT_GT(save.response.message.size(), 10u) << where();
  }
  void clearBox() {
    BoundingBoxQuery clear;
    geometry_msgs::Point &a = clear.request.min, &b = clear.request.max;
    bool wrong = false;
    for (double* const coordinate : {&a.x, &a.y, &a.z, &b.x, &b.y, &b.z}) {
      constexpr double kInf = std::numeric_limits<double>::infinity();
      *coordinate =
          dice_.oneIn(2) ? dice_.between(-5.0, 5.0) : dice_.oneOf<double>({1e300, -1e9, kInf, -kInf, 0.0});
      if (!dice_.oneIn(12)) continue;
      *coordinate = std::numeric_limits<double>::quiet_NaN();
      wrong = true;
    }
    EXPECT_EQ(mapper_.call("clear_bbx", clear), !wrong) << where();
  }
  void reload() {
    for (int n = 0; n < 5; ++n) publish(changedCloud(cloudKinds().front()));
    checkSentences();
    mapper_.unload();
    load();
  }

  /// One call for each kind of message, in random order.
  std::vector<std::function<void()>> shuffledKinds() {
    std::vector<std::function<void()>> all;
    const auto append = [&](const auto& kinds) {
      for (const auto& kind : kinds) all.push_back([this, &kind] { send(kind); });
    };
    append(cloudKinds());
    append(transformKinds());
    append(pathKinds());
    append(settingsKinds());
    append(queryKinds());
    append(deedKinds());
    if (isCorrected()) append(correctionKinds());
    for (std::size_t n = all.size(); n > 1; --n) std::swap(all[n - 1], all[dice_.below(n)]);
    return all;
  }

  // --- what must hold afterwards ---

  /// Checks that the log reports what the status reports, similar messages only once.
  void checkSentences() {
    const std::size_t least = mapper_.reasons() > 0 ? 1 : 0;
    const auto end = Clock::now() + std::chrono::seconds(10);  // the log is written by another thread
    while (log_.refusals() - refusals_before_ < least && Clock::now() < end) ros::WallDuration(0.01).sleep();
    EXPECT_GE(log_.refusals() - refusals_before_, least) << where();
    EXPECT_LE(log_.longest().size(), kLongestText) << where() << ": " << log_.longest().substr(0, 300);
  }

  /// Maps a short drive. @return the map.
  std::string drive(bool big_endian) {
    callEmpty("reset");
    Dice dice(seed_);
    for (int scan = 0; scan < 6; ++scan) {
      turn_ = static_cast<std::size_t>(10000 + scan);
      const ros::Time stamp = nextStamp();
      publishHonestTransforms(stamp);
      PointCloud2 cloud = honestCloud("honest_sensor", stamp, dice);
      Dice alpha(seed_);
      if (big_endian) {
        swapBytes(cloud);
        setAlpha(cloud, alpha);
      }
      ++sent_;
      clouds_[static_cast<std::size_t>(scan) % inputs_].publish(
          boost::shared_ptr<PointCloud2>(new PointCloud2(cloud)));
      expectAnswer({"mapped"});
    }
    SaveMap save;
    save.request.path = folder_ / "drive.ply";
    save.request.include = "occupied,free,occluded";
    EXPECT_TRUE(mapper_.call("save_map", save) && save.response.success) << save.response.message;
    std::ifstream in(save.request.path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }

  std::string freshDrive(bool big_endian) {
    mapper_.unload();
    load();
    return drive(big_endian);
  }

  void mapsAsEver() {
    begin("drive");
    listeners_.leave();
    restoreSettings();
    for (int n = 0; n < 3; ++n) {  // the mapper may first have to recognise a time jump
      turn_ = static_cast<std::size_t>(9000 + n);
      publish(changedCloud(cloudKinds().front()));
      answer();
    }
    const std::string after = drive(false);
    EXPECT_GT(after.size(), 1000u) << where();
    checkSentences();
    const std::string fresh = freshDrive(false);
    EXPECT_TRUE(fresh == after) << where() << ": the map is not that of a fresh mapper";
    EXPECT_TRUE(freshDrive(true) == fresh)
        << where() << ": the map of big-endian clouds with an alpha differs";
  }

  Mapper& mapper_;
  LogReader& log_;
  Watchdog& watchdog_;
  Results& results_;
  const Settings& settings_;
  const std::uint64_t seed_;
  Dice dice_;
  Listeners listeners_;
  TemporaryFolder folder_;
  int journal_;
  std::size_t inputs_ = 1;
  bool points_have_times_ = false;
  std::vector<ros::Publisher> clouds_;
  ros::Publisher transforms_, static_transforms_, paths_;
  std::string kind_ = "load";
  Clock::time_point begun_ = Clock::now();
  std::size_t number_ = 0, turn_ = 0, refusals_before_ = 0;
  std::uint64_t sent_ = 0;  ///< clouds sent since the mapper was loaded
  MappingStatus before_;
  dynamic_reconfigure::Config original_;
};

/// name, message and answers of every kind, as rows of docs/robustness.md.
std::vector<std::pair<std::string, std::string>> allRows() {
  std::vector<std::pair<std::string, std::string>> rows;
  const auto add = [&](const std::string& name, const std::string& sent, const std::string& answers) {
    rows.emplace_back(name, "| `" + name + "` | " + sent + " | " + answers + " |");
  };
  const auto join = [](const Answers& answers) {
    std::string text;
    for (const std::string& answer : answers) text += (text.empty() ? "" : ", ") + answer;
    return text;
  };
  for (const CloudKind& kind : cloudKinds()) add(kind.name, kind.sent, join(kind.answers));
  for (const TransformKind& kind : transformKinds()) add(kind.name, kind.sent, join(kind.answers));
  for (const PathKind& kind : pathKinds()) add(kind.name, kind.sent, kind.written ? "written" : "refused");
  for (const SettingsKind& kind : settingsKinds())
    add(kind.name, kind.sent, kind.refused ? "refused as a whole" : "applied or refused as a whole");
  for (const QueryKind& kind : queryKinds())
    add(kind.name, kind.sent, kind.answered ? "answered" : "refused");
  for (const CorrectionKind& kind : correctionKinds())
    add(kind.name, kind.sent, kind.used ? "used" : "refused");
  for (const DeedKind& kind : deedKinds()) add(kind.name, kind.sent, "as each cloud by itself");
  return rows;
}

void print(Results& results) {
  for (const auto& [kind, tried] : results.tried) {
    std::string answers;
    const auto found = results.answers.find(kind);
    if (found != results.answers.end()) {
      for (const auto& [answer, count] : found->second)
        answers += " " + std::to_string(count) + " " + answer + ";";
    }
    const double each = 1e3 * results.seconds[kind] / static_cast<double>(tried);
    std::printf("[hostile] %-26s %5zu, %5.0f ms each:%s\n", kind.c_str(), tried, each, answers.c_str());
  }
}

TEST(Hostile, NothingCrashesHangsOrIsLost) {
  const auto seed =
      static_cast<std::uint64_t>(std::atoll(environment("BKI_MAPPING_HOSTILE_SEED", "1").c_str()));
  const auto messages =
      static_cast<std::size_t>(std::atoll(environment("BKI_MAPPING_HOSTILE_MESSAGES", "2000").c_str()));
  const double seconds = std::atof(environment("BKI_MAPPING_HOSTILE_SECONDS", "0").c_str());
  const std::string only = environment("BKI_MAPPING_HOSTILE_SETTINGS", "");
  std::vector<Settings> chosen;
  for (const Settings& settings : allSettings()) {
    if (only.empty() || settings.name == only) chosen.push_back(settings);
  }
  ASSERT_FALSE(chosen.empty()) << "no settings are named '" << only << "'";
  const std::size_t kinds = allRows().size();
  const std::size_t rounds =
      seconds > 0.0 ? 2 : (messages + chosen.size() * kinds - 1) / (chosen.size() * kinds);

  ros::NodeHandle node;
  Results results;
  Watchdog watchdog;
  LogReader log(node);
  Mapper mapper(node);
  const auto start = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  for (std::uint64_t turn = 0; turn == 0 || elapsed() < seconds; ++turn) {
    for (const Settings& settings : chosen) {
      const double before = elapsed();
      Attack(node, mapper, log, watchdog, results, settings, seed + turn).run(rounds);
      std::printf("[hostile] settings %s, seed %lu: %zu messages so far, %.1f s, %.0f MB\n",
                  settings.name.c_str(), seed + turn, results.messages, elapsed() - before, residentMemory());
      std::fflush(stdout);
      if (HasFatalFailure() || (seconds > 0.0 && elapsed() > seconds)) break;
    }
    if (HasFailure()) break;
  }
  print(results);
  std::printf(
      "[hostile] %zu kinds, %zu messages in %.0f s, %zu status messages, %zu kB of log, at most %.0f MB\n",
      results.tried.size(), results.messages, elapsed(), mapper.statuses(), log.bytes() / 1000,
      results.most_memory);
  if (HasFailure()) return;
  for (const auto& [kind, row] : allRows()) EXPECT_GT(results.tried[kind], 0u) << kind << " was not tried";
  for (const CloudKind& kind : cloudKinds()) {
    std::size_t answered = 0;
    for (const auto& [answer, count] : results.answers[kind.name]) answered += count;
    EXPECT_EQ(answered, results.tried[kind.name]) << kind.name;
  }
  EXPECT_EQ(mapper.faults(), 0u);
}

TEST(Hostile, NewFramesCostWhatTf2KeepsOfThem) {
  constexpr int kMessages = 200;
  ros::NodeHandle node;
  Results results;
  Watchdog watchdog;
  LogReader log(node);
  Mapper mapper(node);
  Attack attack(node, mapper, log, watchdog, results, allSettings().front(), 1);
  const double before = attack.floodFrames(kMessages / 4);  // allocations made only once
  const double after = attack.floodFrames(kMessages);
  mapper.unload();
  const double each = 1e6 * (after - before) / (200.0 * kMessages);
  std::printf("[hostile] tf2 keeps %.0f bytes of a frame\n", each);
  EXPECT_LT(each, kSanitized ? 20000.0 : 2000.0);
}

bool isRow(const std::string& line) {
  return line.compare(0, 3, "| `") == 0 && line.find('/') < line.find("` |");
}

/// Puts all rows in the place of those of a document.
void writeRows(const std::string& document) {
  std::ifstream in(document);
  std::string text;
  bool written = false;
  for (std::string line; std::getline(in, line);) {
    if (!isRow(line)) {
      text += line + "\n";
    } else if (!std::exchange(written, true)) {
      for (const auto& [kind, row] : allRows()) text += row + "\n";
    }
  }
  std::ofstream(document) << text;
}

TEST(Hostile, KindsAreThoseOfTheDocumentation) {
  const std::string document = std::string(BKI_MAPPING_SOURCE_DIR) + "/docs/robustness.md";
  if (!environment("BKI_MAPPING_WRITE_KINDS", "").empty()) writeRows(document);
  std::ifstream in(document);
  std::set<std::string> rows;
  for (std::string line; std::getline(in, line);) {
    if (isRow(line)) rows.insert(line);
  }
  for (const auto& [kind, row] : allRows()) {
    EXPECT_EQ(rows.erase(row), 1u) << "docs/robustness.md lacks:\n" << row;
  }
  for (const std::string& row : rows) ADD_FAILURE() << "docs/robustness.md has, but no kind is:\n" << row;
}

}  // namespace
}  // namespace bki_mapping::ros_interface

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "hostile_test");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
