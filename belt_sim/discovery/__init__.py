"""Discovery: a law that no library holds, found as an input at one of the five laws, said in a sentence, and added."""
