"""Between the topics of the contract and the data of the mathematics.

`reading` and `reading_reference` make data of messages, and check them; `writing` and `drawing`
make messages of data. Wheels are (right, left) in data and (left, right) in messages: here their
order changes. `names` has the frames and joints, `cdr_layout` the bytes of a message as one row of
numbers.
"""
