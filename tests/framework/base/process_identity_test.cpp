// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/process_tree.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "tests/framework/fixture.hpp"
#include "tests/framework/identities.hpp"

namespace process_identity_test {

using marrow::Life;
using marrow::life_of;
using marrow::this_process;
using runtime_fixture::identity_of;

/// A process that tells its identity and then waits to be killed.
struct Child {
  Child() {
    int ends[2];
    EXPECT_EQ(pipe(ends), 0);
    number = fork();
    if (number == 0) {
      const std::string text = this_process();
      if (write(ends[1], text.data(), text.size()) < 0) _exit(1);
      for (;;) pause();
    }
    identity.resize(200);
    identity.resize(std::size_t(std::max<ssize_t>(0, read(ends[0], identity.data(), identity.size()))));
    close(ends[0]);
    close(ends[1]);
  }
  ~Child() { end(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  void end() {
    if (number > 0) kill(number, SIGKILL), waitpid(number, nullptr, 0);
    number = 0;
  }
  pid_t number = 0;
  std::string identity;
};

TEST(ProcessIdentityTest, ItIsAFileNameOfFixedWidth) {
  const std::string& own = this_process();
  EXPECT_TRUE(marrow::is_identity(own)) << own;
  EXPECT_EQ(own.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789."),
            std::string::npos);
  EXPECT_LT(own.size(), 70u) << "a key and a number stand beside it";
  EXPECT_EQ(own.size(), Child().identity.size()) << "so they sort by process";
  EXPECT_EQ(&own, &this_process());
}

TEST(ProcessIdentityTest, LifeOfProcessesOfThisHost) {
  EXPECT_EQ(life_of(this_process()), Life::lives);
  Child child;
  EXPECT_NE(child.identity, this_process());
  EXPECT_EQ(life_of(child.identity), Life::lives);
  kill(child.number, SIGKILL);
  siginfo_t info;
  ASSERT_EQ(waitid(P_PID, id_t(child.number), &info, WEXITED | WNOWAIT), 0);
  EXPECT_EQ(life_of(child.identity), Life::ended) << "killed, but not yet waited for";
  child.end();
  EXPECT_EQ(life_of(child.identity), Life::ended);
}

TEST(ProcessIdentityTest, AProcessThatGotTheNumberOfAnotherIsAnother) {
  const std::string& own = this_process();
  const std::string number = own.substr(own.rfind('.', own.rfind('.') - 1) + 1, 8);
  EXPECT_EQ(life_of(identity_of(number, "000000000001")), Life::ended);
}

TEST(ProcessIdentityTest, NobodyAsksForANumberOfAnotherHost) {
  EXPECT_EQ(life_of(runtime_fixture::process_elsewhere()), Life::unknown);
  std::string ended = runtime_fixture::ended_process();
  EXPECT_EQ(life_of(ended), Life::ended);
  const std::size_t digest = ended.find('.') + 1;
  ended[digest] = ended[digest] == '0' ? '1' : '0';
  EXPECT_EQ(life_of(ended), Life::unknown);
}

TEST(ProcessIdentityTest, OtherTextsAreNoIdentities) {
  for (const char* text : {"", ".", "..", "4711", "host.0123456789abcdef.1", "host.0123456789abcdeg.1.1",
                           "host.0123456789abcdef.0.1", "host.0123456789abcdef.-1.1", "a-b.0123456789abcdef.1.1",
                           ".0123456789abcdef.1.1", "host.0123456789abcdef.1.x"}) {
    EXPECT_FALSE(marrow::is_identity(text)) << text;
    EXPECT_EQ(life_of(text), Life::unknown) << text;
  }
  EXPECT_TRUE(marrow::is_identity("host.0123456789abcdef.1.1"));
}

}  // namespace process_identity_test
