// Atomic files: what they may replace, what they keep, and which temporary files they leave or remove.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <vector>

#include "core/atomic_file.h"
#include "refusal_of.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

namespace fs = std::filesystem;

class FilesAndLinks : public testing::Test {
 protected:
  static std::string read(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  static int modeOf(const std::string& path) {
    struct stat status {};
    EXPECT_EQ(stat(path.c_str(), &status), 0) << path;
    return static_cast<int>(status.st_mode & 0777);
  }
  static std::string faultOf(const std::string& path) {
    return refusalOf<std::runtime_error>([&] { writeTextFile(path, "new"); });
  }
  void expectRefused(const std::string& path, const std::string& words) {
    const std::size_t before = entries();
    const std::string fault = faultOf(path);
    EXPECT_NE(fault.find(words), std::string::npos) << path << ": '" << fault << "'";
    EXPECT_NE(fault.find(path), std::string::npos) << fault;
    EXPECT_EQ(fault.find('\n'), std::string::npos) << fault;
    EXPECT_EQ(entries(), before) << "something is left";
  }
  /// The names of all files in the folder, including hidden ones.
  std::size_t entries() const {
    const fs::directory_iterator all(folder_ / "");
    return static_cast<std::size_t>(std::distance(begin(all), end(all)));
  }
  /// The id of a process that no longer exists.
  static pid_t endedProcess() {
    const pid_t child = fork();
    if (child == 0) _exit(0);
    waitpid(child, nullptr, 0);
    return child;
  }

  TemporaryFolder folder_;
};

TEST_F(FilesAndLinks, WhatIsNoRegularFileIsRefusedByKindAndStays) {
  fs::create_directory(folder_ / "folder");
  expectRefused(folder_ / "folder", "is a folder");
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  expectRefused(folder_ / "pipe", "is a pipe");
  EXPECT_TRUE(fs::is_fifo(folder_ / "pipe"));
  const int end = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  (folder_ / "socket").copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(end, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  expectRefused(folder_ / "socket", "is a socket");
  EXPECT_TRUE(fs::is_socket(folder_ / "socket"));
  close(end);
  // A link to them is refused, too. Only root can create a device, or destroy one: that case needs root.
  fs::create_symlink("pipe", folder_ / "link");
  expectRefused(folder_ / "link", "is a pipe");
  if (mknod((folder_ / "full").c_str(), S_IFCHR | 0666, static_cast<dev_t>(1 << 8 | 7)) == 0) {
    expectRefused(folder_ / "full", "is a device");
    EXPECT_TRUE(fs::is_character_file(folder_ / "full"));
  }
}

TEST_F(FilesAndLinks, LinksStayAndTheirTargetIsReplaced) {
  fs::create_directory(folder_ / "folder");
  std::ofstream(folder_ / "folder/target") << "old";
  fs::create_symlink("folder/target", folder_ / "relative");
  fs::create_symlink("../relative", folder_ / "folder/to_a_link");
  fs::create_symlink(folder_ / "folder/target", folder_ / "absolute");
  for (const char* link : {"relative", "folder/to_a_link", "absolute"}) {
    writeTextFile(folder_ / link, link);
    EXPECT_TRUE(fs::is_symlink(folder_ / link)) << link;
    EXPECT_EQ(read(folder_ / "folder/target"), link);
  }
  EXPECT_FALSE(fs::is_symlink(folder_ / "folder/target"));
}

TEST_F(FilesAndLinks, TheTargetOfADanglingLinkIsMade) {
  fs::create_directory(folder_ / "folder");
  fs::create_symlink("folder/absent", folder_ / "link");
  fs::create_symlink("link", folder_ / "first");
  writeTextFile(folder_ / "first", "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "first"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(read(folder_ / "folder/absent"), "new");
  fs::create_symlink("nowhere/absent", folder_ / "without folder");
  expectRefused(folder_ / "without folder", "No such file or directory");
}

TEST_F(FilesAndLinks, LoopsOfLinksAreRefused) {
  fs::create_symlink("b", folder_ / "a");
  fs::create_symlink("a", folder_ / "b");
  fs::create_symlink("self", folder_ / "self");
  expectRefused(folder_ / "a", "loop of links");
  expectRefused(folder_ / "self", "loop of links");
}

TEST_F(FilesAndLinks, AnOldFileKeepsItsPermissionsAndANewOneHonoursTheUmask) {
  const std::string old = folder_ / "old";
  std::ofstream(old) << "old";
  for (const mode_t mode : {0600u, 0640u, 0666u, 0755u}) {
    ASSERT_EQ(chmod(old.c_str(), mode), 0);
    writeTextFile(old, "new");
    EXPECT_EQ(modeOf(old), static_cast<int>(mode));
  }
  for (const mode_t mask : {0022u, 0077u, 0002u}) {
    const mode_t before = umask(mask);
    const std::string fresh = folder_ / ("new" + std::to_string(mask));
    writeTextFile(fresh, "new");
    EXPECT_EQ(modeOf(fresh), static_cast<int>(0666u & ~mask));
    umask(before);
  }
}

TEST_F(FilesAndLinks, TheOldFileIsThereUntilTheNewOneIsWhole) {
  const std::string path = folder_ / "file";
  writeTextFile(path, "old");
  {
    AtomicFile file(path);
    std::ofstream(file.temporaryPath()) << "half";
    EXPECT_EQ(read(path), "old");
    EXPECT_NE(file.temporaryPath(), path);
  }
  EXPECT_EQ(read(path), "old");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(FilesAndLinks, TheNextRunRemovesWhatAKilledOneLeft) {
  const std::string path = folder_ / "map.ply";
  const pid_t child = fork();
  if (child == 0) {
    AtomicFile file(path);
    std::ofstream(file.temporaryPath()) << "half a map";
    raise(SIGKILL);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  ASSERT_EQ(entries(), 1u) << "the killed run leaves its temporary file";
  { const AtomicFile file(path); }
  EXPECT_EQ(entries(), 0u);
}

TEST_F(FilesAndLinks, TemporariesOfOthersStay) {
  const std::string path = folder_ / "map.ply";
  const std::string gone = std::to_string(endedProcess()), alive = std::to_string(getppid());
  const auto leave = [&](const std::string& name) {
    std::ofstream(folder_ / name) << "not ours";
    return folder_ / name;
  };
  const std::string removed = leave(".map.ply.bki_mapping-" + gone + "-abcDEF");
  // In a container every run may have the same id. The files of this process are locked.
  const std::string of_namesake = leave(".map.ply.bki_mapping-" + std::to_string(getpid()) + "-abcDEF");
  std::vector<std::string> kept = {
      leave(".map.ply.bki_mapping-" + alive + "-abcDEF"),        // its process still runs
      leave(".other.ply.bki_mapping-" + gone + "-abcDEF"),       // belongs to another file
      leave(".map.ply.bki_mapping-" + gone + "-abcDEF.backup"),  // not a name of a temporary file
      leave(".map.ply.bki_mapping-" + gone),
      leave(".map.ply.bki_mapping-x-abcDEF"),
      leave("map.ply.bki_mapping-" + gone + "-abcDEF"),
  };
  if (geteuid() == 0) {  // owned by another user
    kept.push_back(leave(".map.ply.bki_mapping-" + gone + "-nobody"));
    ASSERT_EQ(chown(kept.back().c_str(), 12345, 12345), 0);
  }
  fs::create_symlink(kept[0], folder_ / (".map.ply.bki_mapping-" + gone + "-aalink"));
  kept.push_back(folder_ / (".map.ply.bki_mapping-" + gone + "-aalink"));
  writeTextFile(path, "new");
  EXPECT_FALSE(fs::exists(removed));
  EXPECT_FALSE(fs::exists(of_namesake));
  for (const std::string& name : kept) EXPECT_TRUE(fs::exists(fs::symlink_status(name))) << name;
}

TEST_F(FilesAndLinks, TwoAtATimeDoNotMeet) {
  const std::string path = folder_ / "file";
  AtomicFile first(path), second(path);
  std::ofstream(first.temporaryPath()) << "first";
  std::ofstream(second.temporaryPath()) << "second";
  { const AtomicFile third(path); }
  second.commit();
  EXPECT_EQ(read(path), "second");
  first.commit();
  EXPECT_EQ(read(path), "first");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(FilesAndLinks, AFullDiskIsSaidWithTheFreeSpace) {
  const std::string path = folder_ / "file";
  writeTextFile(path, "old");
  const std::string fault = refusalOf<std::runtime_error>([&] {
    const FullDisk full(1000);
    writeTextFile(path, std::string(5000, 'x'));
  });
  EXPECT_NE(fault.find(path + " cannot be written: File too large"), std::string::npos) << fault;
  EXPECT_NE(fault.find("MB free"), std::string::npos) << fault;
  EXPECT_EQ(read(path), "old");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(FilesAndLinks, TheLongestNamesWork) {
  const std::string longest(255, 'n');
  writeTextFile(folder_ / longest, "new");
  EXPECT_EQ(read(folder_ / longest), "new");
  expectRefused(folder_ / std::string(256, 'n'), "File name too long");
  expectRefused("", "cannot be written");
}

TEST_F(FilesAndLinks, AFileOfTheWorkingFolderNeedsNoPath) {
  const fs::path before = fs::current_path();
  fs::current_path(folder_ / "");
  writeTextFile("file", "new");
  fs::create_symlink("file", "link");
  writeTextFile("link", "newer");
  fs::current_path(before);
  EXPECT_EQ(read(folder_ / "file"), "newer");
  EXPECT_EQ(entries(), 2u);
}

}  // namespace
}  // namespace bki_mapping
