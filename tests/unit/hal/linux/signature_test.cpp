// SPDX-License-Identifier: MIT
// Signatures and keys that Debian's minisign made, and each byte of them changed; a folder of keys.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/cases.h"
#include "tests/support/temporary.h"

extern "C" {
#include "hal/linux/enrolled.h"
#include "hal/linux/signature.h"
}

namespace {
bool sodium_starts = true;
}

// In place of libsodium's.
extern "C" int sodium_init() {
    static const auto of_library = reinterpret_cast<int (*)()>(dlsym(RTLD_NEXT, "sodium_init"));
    return sodium_starts ? of_library() : -1;
}

namespace {

namespace fs = std::filesystem;

// minisign -G -W; minisign -S -m FILE -t "machine:…", and with -l for the older kind
const std::string file = "{\"machine\": {\"name\": \"lathe 3\"}, \"revision\": 12}\n";
const std::string plant_key =
    "untrusted comment: minisign public key AF718FCB00036D7D\n"
    "RWR9bQMAy49xr/XxmCiQKlwJCQk2NVn8MS0d88NK0ze8PfoB+H+nu5Bn\n";
const std::string other_key =
    "untrusted comment: minisign public key 1A4FCD1947437D08\n"
    "RWQIfUNHGc1PGqLdLsB8v0JOLceNLJBuI4iwQoQQrMhffblSxdjHMVCz\n";
const std::string hashed =
    "untrusted comment: any words\n"
    "RUR9bQMAy49xr4i3YmRtSXSIwEDSJhDuWvBPEZ14gp6YPbLd28AMfOspHDogl3PyrjUp5V53U4dKsgchbLww7k4VdZ7p"
    "oBEBNAs=\n"
    "trusted comment: machine:lathe 3 revision:12\n"
    "2LOsxlrYuyx48ECFYPT89Ysnp8UdMCN9u9NODUhEi1Dd9sjeYux7/jcAmtuBlxCZGoPoN3H7RTQbqLQWI1ucAg==\n";
const std::string of_the_file_itself =
    "untrusted comment: any words\n"
    "RWR9bQMAy49xrxskYUTAHFI3OuLxsvA7lO2x/wLGwalOCGwYzLGx1rQ7tnSSn57UHqOYwdSah3vY5WkPAupjA9e2g+hE"
    "+aG5iwU=\n"
    "trusted comment: legacy\n"
    "7YcHSSpkPfql1aFoPPiIcVvXIb/IAFlGcBuJB2uf4ejS7kBPRL3fDydtFMZiaewf7YchOl+q+m5DAjg+nzq1CA==\n";

bool is_signed(const std::string &bytes, const std::string &signature, const std::string &key) {
    cb_public_key parsed_key;
    cb_signature parsed;
    return cb_public_key_parse(&parsed_key, key.data(), key.size()) &&
           cb_signature_parse(&parsed, signature.data(), signature.size()) &&
           cb_signature_fits(&parsed, &parsed_key, bytes.data(), bytes.size());
}

// The bytes behind the first line's "untrusted comment: ", which nobody vouches for.
bool is_free(const std::string &text, std::size_t at) {
    return text[0] == 'u' && at >= std::string("untrusted comment: ").size() &&
           at < text.find('\n');
}

// Each single bit of a byte; in scripts/test --long each other value of it.
std::vector<int> masks() {
    const bool all = compbox_test::long_tests();
    std::vector<int> found;
    for (int mask = 1; mask < 256; ++mask)
        if (all || (mask & (mask - 1)) == 0) found.push_back(mask);
    return found;
}

// out: the place of the first change of one byte that `good` accepts; npos: none. The words of an
// untrusted comment may change.
template <typename Good>
std::size_t accepted_change(const std::string &text, Good &&good) {
    const auto all = masks();
    for (std::size_t at = 0; at < text.size(); ++at) {
        if (is_free(text, at)) continue;
        for (const int mask : all) {
            std::string changed = text;
            changed[at] = static_cast<char>(changed[at] ^ mask);
            if (good(changed)) return at;
        }
    }
    return std::string::npos;
}

TEST(signature, of_minisign_fits_its_file_and_key_alone) {
    for (const auto &signature : {hashed, of_the_file_itself}) {
        EXPECT_TRUE(is_signed(file, signature, plant_key));
        EXPECT_FALSE(is_signed(file, signature, other_key));
        EXPECT_FALSE(is_signed(file + " ", signature, plant_key));
        EXPECT_FALSE(is_signed(file.substr(1), signature, plant_key));
        EXPECT_FALSE(is_signed("", signature, plant_key));
    }
}

TEST(signature, any_changed_byte_of_the_file_is_noticed) {
    for (const auto &signature : {hashed, of_the_file_itself})
        EXPECT_EQ(
            accepted_change(file, [&](auto &f) { return is_signed(f, signature, plant_key); }),
            std::string::npos);
}

TEST(signature, any_changed_byte_but_of_the_untrusted_words_is_noticed) {
    for (const auto &signature : {hashed, of_the_file_itself})
        EXPECT_EQ(accepted_change(signature, [](auto &s) { return is_signed(file, s, plant_key); }),
                  std::string::npos);
    std::string other_words = hashed;
    other_words.replace(19, 3, "ANY");
    EXPECT_TRUE(is_signed(file, other_words, plant_key));
}

TEST(signature, any_changed_byte_of_a_key_is_noticed) {
    EXPECT_EQ(accepted_change(plant_key, [](auto &k) { return is_signed(file, hashed, k); }),
              std::string::npos);
}

TEST(signature, of_another_shape_is_refused) {
    for (std::size_t length = 0; length < hashed.size(); ++length)
        EXPECT_FALSE(is_signed(file, hashed.substr(0, length), plant_key)) << length;
    for (std::size_t length = 0; length < plant_key.size(); ++length)
        EXPECT_FALSE(is_signed(file, hashed, plant_key.substr(0, length))) << length;
    EXPECT_FALSE(is_signed(file, hashed + "\n", plant_key));
    EXPECT_FALSE(is_signed(file, hashed, plant_key + "\n"));
    std::string longest = hashed;
    longest.insert(19, CB_MOST_SIGNATURE_TEXT - hashed.size() - 1, 'x');
    EXPECT_TRUE(is_signed(file, longest, plant_key));
    longest.insert(19, 1, 'x');
    EXPECT_FALSE(is_signed(file, longest, plant_key));
    std::string other_kind = hashed;  // "EC"
    other_kind[other_kind.find("RUR9") + 2] = 'N';
    EXPECT_FALSE(is_signed(file, other_kind, plant_key));
}

// in : at, place of a base64 line of `text`
void expect_no_other_length(const std::string &text, std::size_t at,
                            const std::function<bool(const std::string &)> &good) {
    const std::size_t end = text.find('\n', at);
    ASSERT_TRUE(good(text));
    for (std::size_t i = at; i <= end; ++i) {
        std::string longer = text;
        EXPECT_FALSE(good(longer.insert(i, 1, i == end ? '=' : 'A'))) << i;
    }
    std::string shorter = text;
    EXPECT_FALSE(good(shorter.replace(end - 4, 4, "AA=="))) << "as many characters of fewer bytes";
}

TEST(signature, base64_of_another_length_is_refused) {
    expect_no_other_length(plant_key, plant_key.find("RWR9"),
                           [](auto &key) { return is_signed(file, hashed, key); });
    for (const char *line : {"RUR9", "2LOs"})
        expect_no_other_length(hashed, hashed.find(line),
                               [](auto &text) { return is_signed(file, text, plant_key); });
}

TEST(signature, fits_nothing_if_the_library_does_not_start) {
    sodium_starts = false;
    EXPECT_FALSE(is_signed(file, hashed, plant_key));
    sodium_starts = true;
    EXPECT_TRUE(is_signed(file, hashed, plant_key));
}

struct enrolled : ::testing::Test {
    enrolled() {
        folder = compbox_test::temporary("enrolled");
        fs::remove_all(folder);
        fs::create_directories(keys());
        write("keys/README", "no key");
        write("c.json.minisig", hashed);
    }
    std::string keys() const { return folder + "/keys"; }
    std::string path() const { return folder + "/c.json"; }
    void write(const std::string &name, const std::string &text) {
        std::ofstream(folder + "/" + name) << text;
    }
    cb_enrolled judge(const std::string &bytes = file) {
        return cb_enrolled_judge(keys().c_str(), path().c_str(), bytes.data(), bytes.size(),
                                 message, sizeof message);
    }
    void refuses(const std::string &sentence) {
        EXPECT_EQ(judge(), CB_ENROLLED_REFUSED);
        EXPECT_EQ(message, sentence);
    }
    std::string folder;
    char message[600] = "";
};

TEST_F(enrolled, no_key_takes_any_file) {
    write("keys/.new.pub", "half a key that is being written");
    write("keys/.pub", "no name");
    write("keys/pub", "no ending");
    EXPECT_EQ(judge("anything"), CB_ENROLLED_NONE);
}

TEST_F(enrolled, one_of_several_keys_is_enough) {
    write("keys/other.pub", other_key);
    refuses(path() + ": no key in " + keys() +
            " has signed it; enrol the key, or sign it with another");
    write("keys/plant.pub", plant_key);
    write("keys/same.pub", plant_key);
    EXPECT_EQ(judge(), CB_ENROLLED_SIGNED);
}

TEST_F(enrolled, names_the_key) {
    write("keys/plant.pub", plant_key);
    EXPECT_EQ(judge(), CB_ENROLLED_SIGNED);
    EXPECT_EQ(message, keys() + "/plant.pub");
}

TEST_F(enrolled, a_key_that_cannot_be_read_refuses_every_file) {
    write("keys/plant.pub", plant_key);
    write("keys/broken.pub", plant_key.substr(0, 60));
    refuses(keys() + "/broken.pub: is not a public key of minisign's format; replace or remove it");
    fs::remove(keys() + "/broken.pub");
    ASSERT_EQ(mkfifo((keys() + "/pipe.pub").c_str(), 0600), 0);
    refuses(keys() +
            "/pipe.pub: cannot be read: it is not a regular file; put the file itself there");
    fs::remove_all(keys());
    refuses(keys() +
            ": cannot be read: No such file or directory; make this folder, or leave --keys out");
}

TEST_F(enrolled, a_signature_that_is_missing_damaged_or_of_another_file_is_refused) {
    write("keys/plant.pub", plant_key);
    EXPECT_EQ(judge(file + " "), CB_ENROLLED_REFUSED);
    EXPECT_EQ(message, path() + ": is not what was signed, or " + path() +
                           ".minisig was changed; sign it again");
    write("c.json.minisig", hashed.substr(0, 200));
    refuses(path() + ".minisig: is not a signature of minisign's format; sign " + path() +
            " again");
    fs::remove(path() + ".minisig");
    refuses(path() + ": is not signed: " + path() +
            ".minisig: No such file or directory; sign it with compbox sign");
}

// While file and signature are being replaced, one of two names has the signature that fits.
TEST_F(enrolled, a_new_signature_beside_the_old_one_counts_too) {
    write("keys/plant.pub", plant_key);
    write("c.json.minisig", of_the_file_itself);
    write("c.json.minisig.new", "half");
    EXPECT_EQ(judge(), CB_ENROLLED_SIGNED);
    write("c.json.minisig", "of the file before");
    write("c.json.minisig.new", hashed);
    EXPECT_EQ(judge(), CB_ENROLLED_SIGNED);
    EXPECT_EQ(message, keys() + "/plant.pub");
    fs::remove(path() + ".minisig");
    EXPECT_EQ(judge(), CB_ENROLLED_SIGNED);
    EXPECT_EQ(judge("another"), CB_ENROLLED_REFUSED);
}

}  // namespace
